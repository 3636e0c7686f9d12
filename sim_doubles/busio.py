"""`busio.I2C` on doubles, for drivers written for CircuitPython; Blinka is not needed.

    with plug(1, [Pca9685Double(monotonic_ns)]):
        pwm = adafruit_pca9685.PCA9685(I2C())

As on a microcontroller the bus must be locked before it is used. Errors are those of Blinka on
Linux: OSError with the errno of the adapter. `frequency` and `timeout` change nothing, as there.
"""

from firmware_runtime.hal.circuitpython.busio import SPI, UART
from firmware_runtime.hal.circuitpython.i2c_base import CircuitPythonI2c
from firmware_runtime.hal.i2c import Message
from sim_doubles import plugged

__all__ = ["I2C", "SPI", "UART"]


class I2C(CircuitPythonI2c):
    """The bus plugged in at `bus`, whatever the pins. Raises FileNotFoundError where none is."""

    def __init__(
        self,
        scl: object = None,
        sda: object = None,
        frequency: int = 100_000,
        timeout: int = 255,
        *,
        bus: int | str = 1,
    ) -> None:
        del scl, sda, frequency, timeout
        super().__init__()
        self._path = plugged.path_of(bus)
        plugged.functions(self._path)

    def _transaction(self, address: int, messages: tuple[Message, ...]) -> bytes:
        return plugged.bus_at(self._path).transfer(address, messages)
