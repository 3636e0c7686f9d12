"""Lines of a robot: I2C buses, serial ports and enable line, named by board.toml."""

from collections.abc import Iterable, Mapping

from msgspec import Struct, field

from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.interlock import EnableLine, Interlock, always_enabled
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.unopened_lines import AbsentBus, AbsentPort


class Lines(Struct, frozen=True):
    """Real ones, doubles, or absent ones: a board's wiring sees no difference."""

    buses: Mapping[str, I2cBus]
    ports: Mapping[str, SerialPort] = field(default_factory=dict)
    interlock: Interlock = always_enabled
    """Output interlock, checked before every write that could."""
    enable: EnableLine | None = None
    """What lets the PWM outputs through, where it is wired."""


def absent_lines(buses: Iterable[str], ports: Iterable[str] = ()) -> Lines:
    """Lines of these names on which nothing can be sent, for a robot that is only built."""
    return Lines(
        {name: AbsentBus(name) for name in buses}, {name: AbsentPort(name) for name in ports}
    )
