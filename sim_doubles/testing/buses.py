"""The buses of one test: doubles on them, and what the doubles warned of."""

from collections.abc import Callable, Mapping, Sequence

from firmware_runtime.board.struck_doubles import NO_DEVICES, StruckDoubles
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.budget import WireClock
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.strike import Strike
from sim_doubles.clock import Now
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target
from sim_doubles.plugged import Plug, plug
from sim_doubles.testing.chips import make
from sim_doubles.testing.virtual_time import POWERED_FOR

BUS_HZ = 400_000
LOG_LENGTH = 10_000
LARGEST_ADDRESS = 0x7F


class TestBuses:
    """Buses by number, plugged in when they are asked for, until `end`."""

    __test__ = False  # pytest: a class of fixtures, not of tests

    def __init__(self, clock: WireClock) -> None:
        self._clock = clock
        self._plugs: dict[int | str, Plug] = {}

    def bus(self, number: int | str = 1) -> I2cBusDouble:
        """The bus of that number or path. Raises ConfigError for what is neither."""
        if not isinstance(number, str) and not (type(number) is int and number >= 0):
            raise ConfigError("bus", [f"{number!r}: expected a number, such as 1, or a path"])
        if number not in self._plugs:
            line = I2cBusDouble(
                f"i2c-{number}" if isinstance(number, int) else number,
                self._clock,
                (),
                bus_hz=BUS_HZ,
                reach=self._clock.reach,
                log_length=LOG_LENGTH,
            )
            self._plugs[number] = plug(number, line)
        return self._plugs[number].bus

    @property
    def buses(self) -> Mapping[str, I2cBusDouble]:
        """Those that are plugged in, by name."""
        return {each.bus.name: each.bus for each in self._plugs.values()}

    @property
    def ports(self) -> Mapping[str, SerialPort]:
        """Serial ports: none."""
        return {}

    def strike(self, kind: str, device: str = "", *, for_s: float | None = None) -> None:
        """Break chips now, by kind (`firmware_runtime.hal.strike`): `strike("freeze", "0x68")`.

        `device` is an address, or a bus by name, `i2c-1`, or both, `i2c-1@0x68`; without one all
        buses. `for_s` None is to the end of the test, 0 once. Raises ConfigError.
        """
        struck = StruckDoubles(self, NO_DEVICES, self._clock)
        struck.strike(Strike(kind, device, 0.0, for_s), self._clock())

    def connect(
        self,
        chip: str | Target | Callable[..., object],
        address: int | None = None,
        *,
        bus: int | str = 1,
        **settings: object,
    ) -> object:
        """Wire a double to a bus and return it.

        `chip` is the name of a chip, a double, or the class of one, which is given the clock.
        `settings` are what the double's class takes. Raises ConfigError.
        """
        if isinstance(address, int) and not 0 <= address <= LARGEST_ADDRESS:
            fault = f"address 0x{address:02x}; expected seven bits, 0x00 to 0x{LARGEST_ADDRESS:02x}"
            raise ConfigError(str(chip), [fault])
        double = self._made(chip, address, settings)
        line, targets = self.bus(bus), _targets(chip, double)
        _demand_free(str(chip), targets, line)
        line.connect(*targets)
        return double[0] if isinstance(double, Sequence) else double

    def _made(
        self,
        chip: str | Target | Callable[..., object],
        address: int | None,
        settings: Mapping[str, object],
    ) -> object:
        """The double of a chip that has had power for a while."""
        if isinstance(chip, Target):
            return chip
        powered = _PoweredBefore(self._clock)
        if isinstance(chip, str):
            double = make(chip, powered, address=address, **settings)
        else:
            stated = settings if address is None else {"address": address, **settings}
            double = chip(powered, **stated)
        powered.is_connected = True
        return double

    def warnings(self) -> list[str]:
        """Return warnings about what a real chip would not take as meant."""
        return [
            warning
            for each in self._plugs.values()
            for target in each.bus.targets
            for warning in getattr(target, "warnings", ())
        ]

    def end(self) -> None:
        """Take every bus away."""
        for each in self._plugs.values():
            each.unplug()


class _PoweredBefore:
    """A chip's clock: while the chip is made it is a little earlier, when the chip had power.

    So a sensor has samples when the test begins.
    """

    def __init__(self, clock: Now) -> None:
        self.is_connected = False
        self._clock = clock

    def __call__(self) -> int:
        return self._clock() - (0 if self.is_connected else POWERED_FOR)


def _address(target: Target) -> int | None:
    """Return a target's address, if it states one."""
    address = getattr(target, "address", None)
    return address if isinstance(address, int) else None


def _demand_free(chip: str, targets: Sequence[Target], line: I2cBusDouble) -> None:
    """Raise ConfigError for a target whose address another one on the bus has."""
    for target in targets:
        if (taken := _address(target)) in map(_address, line.targets) and taken is not None:
            fault = f"another chip has the address 0x{taken:02x} on {line.name} already"
            raise ConfigError(chip, [f"{fault}; expected a free one"])


def _targets(chip: object, double: object) -> Sequence[Target]:
    """A double is a target, several, or knows its `targets`."""
    several = getattr(double, "targets", double)
    targets = (several,) if isinstance(several, Target) else several
    if isinstance(targets, Sequence) and all(isinstance(each, Target) for each in targets):
        return targets
    raise ConfigError(str(chip), ["not a chip on I2C; expected one, or the fixture serial_double"])
