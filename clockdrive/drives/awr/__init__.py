"""The AWR Microstep as the application sees it."""
