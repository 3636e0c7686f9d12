"""Double of a MaxBotix sonar with a serial output, free-running: LV-, XL-, HRLV- and HRXL-MaxSonar.

Source: MaxBotix's data sheets. Modelled: banner at power-up, one frame a cycle (R, three or four
digits, carriage return), the unit, the nearest and the no-target reading of each family, bytes that
arrive one by one at 9600 baud, and what a receiver reads when the polarity is RS-232's.

Not modelled: the RX pin, a level and no serial data (bytes sent there are warned of), pulse width
and analogue outputs, the filter of the HR families. Assumed where data sheets are silent or differ
by model: the text of the banner, sent from power-up on; the first ping 250 ms after power-up, then
20 a second (LV), 10 (XL, HRLV) or 7 (HRXL); the frame is out when its cycle ends; a target nearer
than the nearest reading shows as that; readings are rounded. Up to 64 frames wait to be fetched.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.altered_readings import AlteredReadings
from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.clock import Now
from sim_doubles.serial_line import SerialTarget

BAUD = 9600
BITS_PER_BYTE = 10  # start, eight, stop
START_UP = 250 * MILLISECOND
KEPT_FRAMES = 64


@dataclass(frozen=True)
class Family:
    """Format of one family's frames; readings are in `unit_m`."""

    name: str
    unit_m: float
    digits: int
    """At least so many; of a sonar that reaches beyond 999 cm a frame is longer there."""
    nearest: int
    no_target: int
    period: int

    @property
    def banner(self) -> bytes:
        """The lines sent at power-up; an R in them starts no reading."""
        return f"{self.name}-MaxSonar-EZ\rMaxBotix Inc.\rRoHS 1.0\r".encode()

    def reading(self, distance_m: float) -> int:
        """Return what is measured at a distance; infinity is no target."""
        if distance_m < self.no_target * self.unit_m:
            return max(self.nearest, round(distance_m / self.unit_m))
        return self.no_target

    def frame(self, reading: int) -> bytes:
        """Return what is sent."""
        return b"R%0*d\r" % (self.digits, reading)


FAMILIES = {
    "lv": Family("LV", 0.0254, 3, 6, 255, 50 * MILLISECOND),
    "xl": Family("XL", 0.01, 3, 20, 765, 100 * MILLISECOND),
    "xl-10m": Family("XL", 0.01, 3, 20, 1068, 100 * MILLISECOND),
    "hrlv": Family("HRLV", 0.001, 4, 300, 5000, 100 * MILLISECOND),
    "hrxl-5m": Family("HRXL", 0.001, 4, 300, 5000, SECOND // 7),
    "hrxl-10m": Family("HRXL", 0.001, 4, 500, 9999, SECOND // 7),
}


class MaxbotixDouble(SerialTarget):
    """A serial MaxSonar; `distance` gives the distance of the nearest target in m, or infinity.

    It is called once a cycle, at the instant of the ping in ns. `inverted` is a sensor with RS-232
    polarity at a receiver for logic levels. `pings` counts, without those that left no trace.

    A plant whose state depends on the host's writes must see every ping sent before it moves on:
    call `catch_up` first.
    """

    def __init__(
        self,
        now: Now,
        distance: Callable[[int], float],
        *,
        family: str = "xl",
        inverted: bool = False,
    ) -> None:
        if family not in FAMILIES:
            raise ValueError(f"MaxBotix: family is {family!r}, expected one of {list(FAMILIES)}")
        self.family = FAMILIES[family]
        self.warnings = ProtocolWarnings(f"{self.family.name}-MaxSonar")
        self.pings = 0
        self.readings = AlteredReadings(self.family.nearest, self.family.no_target)
        self._now = now
        self._distance = distance
        self._inverted = inverted
        longest = KEPT_FRAMES * len(self.family.frame(self.family.no_target))
        self._on_the_way: deque[tuple[int, int]] = deque(maxlen=longest)
        self._power_up()

    def power_cycle(self) -> None:
        """Lose supply and get it back: what is not out yet is lost, the banner comes again."""
        self._power_up()

    def catch_up(self) -> None:
        """Send every ping due up to now."""
        self._ping_until(self._now())

    # Line face

    def receive(self, data: bytes) -> None:
        """Ignore bytes: the RX pin takes a level."""
        self.warnings.note(f"bytes {data.hex(' ')} sent to the RX pin; it takes a level, no data")

    def transmitted(self, at: int) -> bytes:
        """Return the bytes that are out by `at`."""
        self._ping_until(at)
        out = bytearray()
        while self._on_the_way and self._on_the_way[0][0] <= at:
            out.append(self._on_the_way.popleft()[1])
        return bytes(out)

    # Cycles

    def _power_up(self) -> None:
        now = self._now()
        self._on_the_way.clear()
        self._send(self.family.banner, now)
        self._next_ping_at = now + START_UP

    def _ping_until(self, at: int) -> None:
        """Send the pings due by `at`; of more than can be kept only the last ones."""
        period = self.family.period
        missed = (at - self._next_ping_at) // period + 1 - KEPT_FRAMES
        self._next_ping_at += max(0, missed) * period
        while self._next_ping_at <= at:
            measured = self.family.reading(self._distance(self._next_ping_at))
            frame = self.family.frame(self.readings.altered(measured))
            self.pings += 1
            self._next_ping_at += period
            self._send(frame, self._next_ping_at - _bits(len(frame) * BITS_PER_BYTE))

    def _send(self, data: bytes, at: int) -> None:
        read = _read_inverted(data) if self._inverted else _read_upright(data)
        self._on_the_way.extend((at + _bits(bits), byte) for bits, byte in read)


def _bits(count: int) -> int:
    """Return how long so many bits take, in ns."""
    return count * SECOND // BAUD


def _read_upright(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield each byte with the number of bits after which it is in."""
    for index, byte in enumerate(data):
        yield (index + 1) * BITS_PER_BYTE, byte


def _read_inverted(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield what a receiver makes of a line whose every bit is the wrong way round.

    It takes each fall of the line for a start bit, and bytes without a stop bit as they are.
    """
    line = [bit for byte in data for bit in (1, *(~byte >> n & 1 for n in range(8)), 0)]
    line += [0] * BITS_PER_BYTE
    position = 1
    while position < len(data) * BITS_PER_BYTE:
        if line[position - 1] and not line[position]:
            bits = line[position + 1 : position + 9]
            yield position + BITS_PER_BYTE, sum(bit << n for n, bit in enumerate(bits))
            position += BITS_PER_BYTE
        else:
            position += 1
