"""A sonar as a hardware atomic model: a ranging is a phase, as long as the chip takes for it."""

from dataclasses import dataclass
from typing import Protocol

from firmware_drivers.hardware import Chip, HardwareModel
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import HalError, NotReady

READ_AGAIN_AFTER = 5 * MILLISECOND
READINGS = 5
"""Readings of an echo before that counts as a fault: a chip may be slower than it says.
"""


class RangeFinder(Chip, Protocol):
    """A sonar's driver: a ranging is started, and `ranging_ns` later read, once."""

    @property
    def ranging_ns(self) -> int:
        """From a start until its echo can be read."""

    @property
    def interval_ns(self) -> int:
        """Shortest time from one start to the next."""

    @property
    def nearest_m(self) -> float:
        """The least distance that it says: what is nearer it says to be there, or nothing."""

    def start_ranging(self) -> None:
        """Send one ping."""

    def read_distance(self) -> float:
        """Give its first echo in m, +inf if none came. Raises NotReady while it still ranges."""


@dataclass(frozen=True, slots=True)
class SonarSettings:
    """Period of ranging, and the distance that counts as near."""

    period: int
    """Ns from ping to ping."""
    threshold_m: float
    """An echo at this distance or nearer is a detection."""
    only_entering: bool = False
    """A detection is only what was not there, or farther, at the ping before.

    For a sonar that sweeps: what stands in its beam when it begins is already half past.
    """
    near_m: float = 0.0
    """A detection at this distance or nearer is sent as 2, any other as 1."""
    detection_pings: int = 1
    """Pings in a row that find something near before it is a detection: one alone may be wrong."""


class Sonar(HardwareModel):
    """Ranges every period while started; sends `distance` in m (+inf: no echo), `detected` 1, or 2.

    bring_up (the steps' waits) --> idle;  a step failed --fault!--> bring_up (RETRY_AFTER)
    idle --start? 1--> resting (0) --ping--> ranging (chip.ranging_ns from the ping's end)
    ranging, echo read --> reporting (0) --distance!, detected!--> resting (rest of the period)
    ranging, not ready --> ranging (READ_AGAIN_AFTER), at most READINGS readings
    ranging, resting, chip silent --> reporting (0) --fault!--> resting (rest of the period)
    resting --> ranging;  resting, ranging --start? 0--> the same --> idle

    `start` 0 lets a ranging under way end in silence: the chip is not spoken to meanwhile. A start
    that comes before the chip is up is kept. A distance is sent once or not at all.
    """

    def __init__(self, name: str, chip: RangeFinder, settings: SonarSettings) -> None:
        super().__init__(name, chip.bring_up, chip.line)
        self.start = self.in_port("start", int)
        self.distance_out = self.out_port("distance", float)
        self.detected_out = self.out_port("detected", int)
        if settings.period < chip.interval_ns:
            raise SettingError(
                f"period of {settings.period / 1e6:g} ms",
                where=name,
                expected=f"{chip.interval_ns / 1e6:g} ms or more for the {chip.place}",
            )
        if settings.threshold_m < chip.nearest_m:
            raise SettingError(
                f"threshold of {settings.threshold_m:g} m",
                where=name,
                expected=f"{chip.nearest_m:g} m or more, the nearest that the {chip.place} says",
            )
        self.chip = chip
        self.settings = settings
        self.is_started = False
        self.distance: float | None = None
        self._near_pings = 0
        """Pings in a row, since it was started, that found something near."""
        self.is_detection = False
        self._since_ping = 0
        self._least_interval = 0
        self._readings = 0

    def begin(self) -> None:
        """Range at once if started, else wait for it."""
        if self.is_started:
            self._start()
        else:
            self.passivate("idle")

    def output(self) -> None:
        """Send what the ranging found, or the fault."""
        super().output()
        if self.distance is not None:
            self.distance_out.send(self.distance)
            if self.is_detection:
                self.detected_out.send(2 if self.distance <= self.settings.near_m else 1)

    def proceed(self) -> None:
        """Ping, read, or rest for what is left of the period."""
        self.distance = None
        if self.phase == "ranging":
            self._end_ranging()
        elif self.phase == "reporting":
            self._rest()
        elif self.is_started:
            self._ping()
        else:
            self.passivate("idle")

    def external(self, elapsed: int) -> None:
        """Start or stop; only an idle sonar has to be woken for it."""
        self.is_started = self.start[-1] != 0
        if self.is_started and self.phase == "idle":
            self._start()
        else:
            self.continue_(elapsed)

    # ---------------------------------------------------------------------------------------------

    def _start(self) -> None:
        """Range at once; what has to enter is taken to stand there before the first ping."""
        self._near_pings = self.settings.detection_pings if self.settings.only_entering else 0
        self.activate("resting")

    def _ping(self) -> None:
        self._since_ping = self._readings = 0
        try:
            self.chip.start_ranging()
        except HalError as error:
            self._fail(error)
        else:
            self._least_interval = self.chip.line.elapsed() + self.chip.interval_ns
            self._range_for(self.chip.ranging_ns)

    def _range_for(self, span: int) -> None:
        self.hold_after_transfer("ranging", span)
        self._since_ping += self.sigma

    def _end_ranging(self) -> None:
        if not self.is_started:
            self._rest()
            return
        self._readings += 1
        try:
            self.distance = self.chip.read_distance()
        except NotReady as error:
            if self._readings < READINGS:
                self._range_for(READ_AGAIN_AFTER)
            else:
                self._fail(error)
        except HalError as error:
            self._fail(error)
        else:
            self.consecutive_faults = 0
            self._judge(self.distance)
            self.activate("reporting")

    def _judge(self, distance: float) -> None:
        """Find a detection: near in so many pings in a row, and where it has to enter, just now."""
        is_near, due = distance <= self.settings.threshold_m, self.settings.detection_pings
        self._near_pings = min(self._near_pings, due) + 1 if is_near else 0
        is_late = self.settings.only_entering and self._near_pings > due
        self.is_detection = self._near_pings >= due and not is_late

    def _rest(self) -> None:
        interval = max(self.settings.period, self._least_interval)
        self.hold_in("resting", max(0, interval - self._since_ping))

    def _fail(self, error: HalError) -> None:
        self.note(error)
        self.activate("reporting")
