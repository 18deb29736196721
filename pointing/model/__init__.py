"""Pointing models: terms, models, runs of observations and their files, fits."""
