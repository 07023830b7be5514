"""Puts daylight on pictures: a table of what view rays gather, filled on the device, and a pass that reads it."""
