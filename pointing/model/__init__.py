"""Pointing models: what a run of observations says about the telescope, and the files in which that is kept."""
