"""The mathematics of pointing: no clock, no socket; time is given, angles are radians, durations seconds."""
