"""Double of the Plumb. Source: example, rev. 1. Nothing of the driver's is used here.

Modelled: all commands, the time of a reset and of a conversion, a result that is read once.
Not modelled: noise.
"""

from collections.abc import Callable

from sim_doubles.clock import Now
from sim_doubles.i2c_target import Target

SCALE, DRIFT = 6000, 150
WORDS = {0xA0: SCALE, 0xA2: DRIFT, 0xA4: 0xFFFF - SCALE - DRIFT}
MILLISECOND = 1_000_000


def at_the_surface(_at: int) -> tuple[float, float]:
    """Pressure in Pa, temperature in degC."""
    return 101_325.0, 15.0


class PlumbDouble(Target):
    """A Plumb at `address`; `water` gives pressure in Pa and temperature in degC at an instant."""

    def __init__(
        self,
        now: Now,
        address: int = 0x76,
        water: Callable[[int], tuple[float, float]] = at_the_surface,
    ) -> None:
        self.address = address
        self.warnings: list[str] = []
        self._now = now
        self._water = water
        self._answers_at = 0
        self.power_cycle()

    def power_cycle(self) -> None:
        """Lose supply and get it back: it resets itself."""
        self._write_reset()

    def start(self, address: int, *, read: bool) -> bool:
        """Answer its address once a reset is over."""
        if not read:
            self._answer = b""
        return address == self.address and self._now() >= self._answers_at

    def write(self, byte: int) -> bool:
        """Take a command; refuse what is none."""
        if byte in WORDS:
            self._answer = WORDS[byte].to_bytes(2)
        elif byte == 0x1E:
            self._write_reset()
            self._answers_at = self._now() + 3 * MILLISECOND
        elif byte in {0x40, 0x50}:
            self._result = self._counts(byte)
            self._done_at = self._now() + 5 * MILLISECOND
        elif byte == 0x00:
            self._answer = self._take().to_bytes(3)
        else:
            self.warnings.append(f"command 0x{byte:02x}, which it does not have")
            return False
        return True

    def read(self) -> int:
        """Give the next byte; behind the last one the line stays high."""
        first, self._answer = self._answer[:1], self._answer[1:]
        return first[0] if first else 0xFF

    def stop(self) -> None:
        """Nothing waits for a STOP."""

    def _write_reset(self) -> None:
        self._answer = b""
        self._result = 0
        self._done_at = 0

    def _take(self) -> int:
        if self._result == 0 or self._now() < self._done_at:
            self.warnings.append("it was read before a conversion was over")
            return 0
        result, self._result = self._result, 0
        return result

    def _counts(self, command: int) -> int:
        pressure_pa, water_c = self._water(self._now())
        if command == 0x50:
            return round((water_c + 40.0) * 65536)
        return round((pressure_pa + DRIFT * (water_c - 20.0)) * 65536 / SCALE)
