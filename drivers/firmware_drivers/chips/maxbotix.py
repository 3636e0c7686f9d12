"""MaxBotix serial sonars, LV, XL, HRLV and HRXL families (MaxBotix data sheets, serial output).

The sonar runs freely and sends one frame a cycle: `R`, decimal digits, carriage return. The codec
turns bytes into counts, wherever the stream was entered: it restarts at every `R`, so power-up
banners and broken frames cost nothing but themselves. There is no checksum.

The driver gives no old value: `start_ranging` throws away what has arrived, and only a frame that
begins after it counts. The greatest count of a family means that nothing was hit and becomes +inf;
of anything nearer than its least distance a sonar reports that distance.

Most models send RS-232 polarity, inverted for a UART: bytes then arrive, but no frame, and the
error shows them. The sonar's RX pin (trigger) is left open.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from firmware_drivers.chips.step import Step
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import NotReady

BAUD: Final = 9600
BEGIN: Final = ord("R")
END: Final = ord("\r")
DIGITS: Final = frozenset(b"0123456789")
FRAME_NS: Final = 6_250_000
"""The longest frame, six bytes of ten bits at 9600 baud."""
START_UP_NS: Final = 250_000_000
"""From power-up to the first ping."""
SHOWN: Final = 12
"""Bytes of an unreadable stream that an error shows."""


class Family(NamedTuple):
    """Meaning of the frames of one family, and the slowest member's time for one."""

    digits: tuple[int, ...]
    """Numbers of digits a frame may have."""
    counts_per_m: float
    nearest: int
    """Counts of all that is nearer."""
    nothing_from: int
    """Counts from here on mean that there was no echo; LV sonars say 254 or 255."""
    cycle_ns: int


FAMILIES: Final[Mapping[str, Family]] = MappingProxyType(
    {
        "lv": Family((3,), 1 / 0.0254, 6, 254, 50_000_000),
        "xl": Family((3,), 100, 20, 765, 100_000_000),
        "xl-10m": Family((3, 4), 100, 20, 1068, 100_000_000),
        "hrlv": Family((4,), 1000, 300, 5000, 100_000_000),
        "hrxl-5m": Family((4,), 1000, 300, 5000, 200_000_000),
        "hrxl-10m": Family((4,), 1000, 500, 9999, 200_000_000),
    }
)


class FrameDecoder:
    """Bytes in, counts out; bytes may be cut anywhere, and whatever is no frame is skipped."""

    def __init__(self, digits: tuple[int, ...]) -> None:
        self._lengths = digits
        self._digits: bytearray | None = None

    def restart(self) -> None:
        """Forget a frame that has begun."""
        self._digits = None

    def feed(self, data: bytes) -> list[int]:
        """Take what has arrived; return the counts of the frames it completes, in order."""
        counts = []
        for byte in data:
            if byte == BEGIN:
                self._digits = bytearray()
            elif self._digits is None:
                continue
            elif byte in DIGITS and len(self._digits) < self._lengths[-1]:
                self._digits.append(byte)
            else:
                if byte == END and len(self._digits) in self._lengths:
                    counts.append(int(self._digits))
                self._digits = None
        return counts


class Maxbotix:
    """One serial sonar: `ranging_ns` after `start_ranging` a distance can be read, once.

    `interval_ns` is the shortest time from one start to the next, `limits_m` the nearest and the
    farthest it may say; most models of a family say `nearest_m` of all that is nearer.
    """

    def __init__(self, port: SerialPort, family: str) -> None:
        self.place = f"MaxBotix {family} on {port.name}"
        if family not in FAMILIES:
            raise SettingError(f"expected one of {', '.join(FAMILIES)}", where=self.place)
        self.family = FAMILIES[family]
        self.ranging_ns = self.family.cycle_ns * 11 // 10 + FRAME_NS
        self.interval_ns = self.ranging_ns
        self.nearest_m = self.family.nearest / self.family.counts_per_m
        self.limits_m = (0.0, self.family.nothing_from / self.family.counts_per_m)
        self.line = self._port = port
        self._decoder = FrameDecoder(self.family.digits)
        self._unread: bytes | None = None

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps to ready: listen until one frame must have come, of a new one as well.

        The steps raise NotReady if there is none, BusFault or PortClosed.
        """
        return (
            Step("listen", self.start_ranging, START_UP_NS + self.ranging_ns),
            Step("identify", self._expect_frame, 0),
        )

    def start_ranging(self) -> None:
        """Throw away what has arrived: the next frame to begin is the one that counts."""
        self._unread = None
        self._port.discard_input()
        self._decoder.restart()
        self._unread = b""

    def read_distance(self) -> float:
        """Take the newest frame since `start_ranging`: distance in m, +inf if nothing was hit.

        Raises NotReady if no ranging was started, no frame came yet, or it says 0, which no sonar
        measures; BusFault or PortClosed.
        """
        if self._unread is None:
            raise NotReady(
                "no ranging to read", where=self.place, expected="one started and not read"
            )
        arrived = self._port.read_available()
        counts = self._decoder.feed(arrived)
        if not counts:
            self._unread = (self._unread + arrived)[-SHOWN:]
            raise NotReady(self._what_came(self._unread), where=self.place)
        if counts[-1] == 0:
            raise NotReady(
                "a frame says 0", where=self.place, expected="its least distance or more"
            )
        self._unread = None
        if counts[-1] >= self.family.nothing_from:
            return math.inf
        return counts[-1] / self.family.counts_per_m

    def _expect_frame(self) -> None:
        """Check that frames of the family arrive. Raises NotReady if not, with what did arrive."""
        self.read_distance()

    def _what_came(self, unread: bytes) -> str:
        digits = " or ".join(map(str, self.family.digits))
        expected = f"expected R, {digits} digits and a carriage return"
        if not unread:
            return f"nothing received, {expected}; unplugged, unpowered or its RX pin held low"
        return (
            f"no frame in {unread.hex(' ')}, {expected}; another family, another rate, or its "
            "signal is inverted (RS-232 polarity)"
        )
