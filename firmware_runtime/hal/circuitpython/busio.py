"""CircuitPython's `busio`, in name: drivers mention its classes in their types.

None can be made here. A driver in a robot is given the robot's bus, a driver in a test the test's.
"""


class _InName:
    def __init__(self, *_: object, **__: object) -> None:
        raise NotImplementedError(
            f"busio.{type(self).__name__}: there is none of its own here; expected the bus "
            "that firmware_drivers.circuitpython.Busio makes of a robot's, or in a test "
            "sim_doubles.busio.I2C"
        )


class I2C(_InName):
    """I2C."""


class SPI(_InName):
    """SPI; no bus of the HAL is one."""


class UART(_InName):
    """A serial port; pyserial opens those of doubles (`sim_doubles.serial_pty`)."""
