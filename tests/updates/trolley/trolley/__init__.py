"""A robot without I2C: its chips are on serial ports, which a pseudo-terminal can be."""
