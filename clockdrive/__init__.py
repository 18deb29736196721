"""Clockdrive points telescopes: the application layer."""
