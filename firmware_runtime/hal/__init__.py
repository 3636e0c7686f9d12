"""The words drivers speak: I2C bus, serial port, enable line, interlock, and errors of the world.

Drivers and boards use the abstract ones; `linux` and its neighbours are the real ones and the only
modules that import smbus2, pyserial or gpiod, `served` speaks to doubles in another process.
Accounting, retries, time on the wire and the bus budget stand between the two, for all alike.
"""
