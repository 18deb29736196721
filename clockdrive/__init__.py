"""Clockdrive points telescopes: the application layer."""

from clockdrive.distribution import verify

verify()
