"""The Plumb, a depth gauge on I2C that takes its time (example, rev. 1)."""
