"""The Winch, a motor with brake and encoder on I2C, from a register table (example, rev. 1)."""
