"""Bytes: links over TCP, serial and memory, framing, recording. Knows no telescope."""
