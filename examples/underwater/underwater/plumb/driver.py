"""Plumb, depth gauge with a 24-bit converter (example, rev. 1): commands to SI units.

It takes commands and has no registers. The caller waits for the conversions.
"""

from dataclasses import dataclass
from typing import Final

from firmware_drivers.chips.i2c_chip import I2cChip
from firmware_drivers.chips.step import Step

from firmware_runtime import MILLISECOND, I2cBus, Message, NotReady, WrongDevice

ADDRESS: Final = 0x76
RESET, READ, PRESSURE, TEMPERATURE = 0x1E, 0x00, 0x40, 0x50
COEFFICIENTS = (0xA0, 0xA2, 0xA4)
RESET_NS: Final = 3 * MILLISECOND
CONVERSION_NS: Final = 5 * MILLISECOND
SURFACE_PA: Final = 101_325.0
PA_PER_M: Final = 1025.0 * 9.80665
"""Of sea water."""
TRAFFIC: Final[tuple[tuple[Message, ...], ...]] = (
    (bytes((PRESSURE,)),),
    (bytes((READ,)), 3),
    (bytes((TEMPERATURE,)),),
    (bytes((READ,)), 3),
)
"""Transactions of one reading, for the bus-time budget."""


@dataclass(frozen=True)
class Sounding:
    """Depth below the surface in m, pressure in Pa, temperature of the water in degC."""

    depth_m: float
    pressure_pa: float
    water_c: float


class Plumb(I2cChip):
    """One Plumb: after `bring_up` begin a conversion, let CONVERSION_NS pass, read it."""

    chip = "Plumb"
    addresses = (ADDRESS,)

    def __init__(self, bus: I2cBus, address: int = ADDRESS) -> None:
        super().__init__(bus, address)
        self._coefficients: tuple[int, int] | None = None

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps from any state to ready; they raise NoAcknowledge or WrongDevice."""
        return (Step("reset", self._reset, RESET_NS), Step("coefficients", self.identify, 0))

    def identify(self) -> None:
        """Read the coefficients: their check is all that identifies the chip."""
        words = [int.from_bytes(self._ask(bytes((each,)), 2)) for each in COEFFICIENTS]
        scale, drift, check = words
        expected = (scale + drift) & 0xFFFF ^ 0xFFFF
        if check != expected:
            raise WrongDevice(
                f"the check reads {check:04x}", where=self.place, expected=f"{expected:04x}"
            )
        self._coefficients = scale, drift

    def begin(self, conversion: int) -> None:
        """Begin a conversion, PRESSURE or TEMPERATURE."""
        self._ask(bytes((conversion,)))

    def read(self) -> int:
        """Read what was converted. Raises NotReady where nothing was."""
        counts = int.from_bytes(self._ask(bytes((READ,)), 3))
        if counts == 0:
            raise NotReady("reads 0", where=self.place, expected="a conversion that is over")
        return counts

    def sounding(self, pressure: int, temperature: int) -> Sounding:
        """What two counts mean. Raises NotReady before the bring-up."""
        if self._coefficients is None:
            raise NotReady("has no coefficients", where=self.place, expected="a bring-up")
        scale, drift = self._coefficients
        water_c = temperature / 65536 - 40.0
        pressure_pa = pressure * scale / 65536 - drift * (water_c - 20.0)
        return Sounding((pressure_pa - SURFACE_PA) / PA_PER_M, pressure_pa, water_c)

    def _reset(self) -> None:
        self._coefficients = None
        self._ask(bytes((RESET,)))

    def _ask(self, *messages: Message) -> bytes:
        with self._must_answer("a Plumb"):
            return self._bus.transaction(self.address, messages)
