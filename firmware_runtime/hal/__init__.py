"""The words drivers speak: I2C bus, and the errors of the world. `linux` is the one real back-end."""
