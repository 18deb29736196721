"""The AWR Microstep: keys that are pressed for a time, and events that tell when it moved."""
