"""Yaw of TachoBot: the gyro's rate integrated, slowly pulled to the compass."""

import math

from firmware_drivers.chips.mpu9250_burst import InertialSample

from firmware_boards.tachobot.settings import ControllerSettings
from firmware_runtime.board.robot import Ending
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import MILLISECOND, SECOND, seconds
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.models.cross_check import (
    CATCHING_UP,
    CrossCheck,
    CrossCheckSettings,
    Source,
    Window,
)
from firmware_runtime.models.motion import Applied, Motion
from firmware_runtime.system.elementary import atan2

FIELDS_AVERAGED = 100
"""Readings of the compass from which its angle at yaw zero is taken; one alone is too noisy."""
FIELDS_PROVED = 150
"""Readings after which what lied during most of the average would have been contradicted."""
DOUBT = 200 * MILLISECOND
"""Time for which they contradict each other, ns, that no sample which came late makes."""
FIELDS_AT_REST = 10
"""Of these the first, before the robot can have turned far: kept where the rest turns out wrong."""
_UNKNOWN_ZERO = Ending(
    "gyro and compass contradict each other before it is certain where the robot was at first",
    failed=True,
)
GAP = 50 * MILLISECOND
"""Time without a sample, ns, in which the robot may have turned as no rate says."""


class Attitude(Atomic):
    """Turns every inertial sample into yaw (rad) and yaw rate (rad/s), at the same instant.

    disabled --enable? true--> waiting --sample?--> estimating (0) --yaw!--> waiting
    waiting --enable? false--> disabled
    any --applied?--> the same
    any, fields too few, not trusted for DOUBT --sample?--> ending (0) --ended!--> lost
    any --contradiction?--> ending (0) --ended!--> lost

    While `trusted` is false gyro and compass contradict each other, and no yaw is sent. Disabled
    again, it goes on estimating and says nothing: the robot may turn meanwhile.

    Yaw is zero where the first sample found the robot and counts anticlockwise seen from above.
    Rates are integrated by the trapezoid rule over the time that really passed. The compass gives
    how far the estimate has strayed from it since the start, on average of its first fields; of
    that, elapsed / time constant is taken off in one step, and all of it after a gap between
    samples that were trusted: what it turned meanwhile only the compass knows. It is taken off
    until CATCHING_UP later, as what a network kept meanwhile comes at once. Whole turns in a gap,
    or made while it is disabled or nothing that drives applies what it is told, do not count: the
    robot would unwind them, faster than its gyro measures. The average ends there, too, and goes
    back to the first few fields: such a turn would be taken for where the robot was at first. What
    contradicts itself by then may have lied about that from the beginning: then yaw zero is not
    known, and the run ends.
    """

    def __init__(
        self, name: str, compass_time_constant: int, *, enabled: bool, gap: int = GAP
    ) -> None:
        super().__init__(name)
        self.sample = self.in_port("sample", InertialSample)
        self.enable = self.in_port("enable", bool)
        self.applied = self.in_port("applied", Applied)
        self.trusted = self.in_port("trusted", bool)
        self.contradiction = self.in_port("contradiction", Fault)
        """The rate is not what drives the robot makes of it, or nothing reaches what drives it."""
        self.yaw = self.out_port("yaw", Motion)
        self.ended = self.out_port("ended", Ending)
        self.compass_time_constant = compass_time_constant
        self.enabled = enabled
        self.gap = gap
        self.is_trusted = True
        self._doubted_for = 0
        self._ending = _UNKNOWN_ZERO
        self.motion: Motion | None = None
        self._since_sample = 0
        self._headings = 0
        self._heading_at_zero = self._heading_at_rest = 0.0
        self._has_gap = False
        """Whether there was one, and no field of the compass CATCHING_UP after it yet."""
        self._since_gap = 0
        self._has_drive = True
        """Whether what drives applies some of its commands, as far as it has said."""
        self._adrift_at = None if enabled else 0.0
        """Its yaw, rad, when it was last enabled and driven; None while it is."""

    def initialize(self) -> None:
        """Wait for a sample, or to be enabled."""
        self.passivate("waiting" if self.enabled else "disabled")

    def output(self) -> None:
        """Send the estimate, or that there will be none."""
        if self.phase == "ending":
            self.ended.send(self._ending)
        elif self.motion is not None:
            self.yaw.send(self.motion)

    def internal(self) -> None:
        """Wait for the next sample."""
        self.passivate("lost" if self.phase == "ending" else "waiting")

    def external(self, elapsed: int) -> None:
        """Take the newest sample in, if enabled."""
        self._since_sample += elapsed
        if self.phase == "lost":
            self.passivate("lost")
            return
        if self.enable or self.applied:
            self._follow_drive()
        self._doubted_for += 0 if self.is_trusted else elapsed
        if self.trusted:
            self.is_trusted = self.trusted[-1]
            self._doubted_for = 0
        if self.contradiction:
            self._ending = Ending(self.contradiction[-1].reason, failed=True)
            self.activate("ending")
            return
        if self._doubted_for >= DOUBT and 0 < self._headings < FIELDS_PROVED:
            self.activate("ending")
            return
        is_sound = bool(self.sample) and self.is_trusted
        if is_sound and (self.enabled or self.motion is not None):
            self.motion = self._estimate(self.sample[-1], self._since_sample)
            self._since_sample = 0
            if self._adrift_at is not None:
                self.motion = _within_half_a_turn(self.motion, self._adrift_at)
        if not self.enabled:
            self.passivate("disabled")
        elif is_sound:
            self.activate("estimating")
        else:
            self.passivate("waiting")

    def _follow_drive(self) -> None:
        """Note whether it is driven, and where it was last."""
        if self.enable:
            self.enabled = self.enable[-1]
        if self.applied:
            self._has_drive = self.applied[-1] is not Applied.NOTHING
        if self.enabled and self._has_drive:
            self._adrift_at = None
        elif self._adrift_at is None:
            self._adrift_at = 0.0 if self.motion is None else self.motion.position

    def _estimate(self, sample: InertialSample, elapsed: int) -> Motion:
        rate, field = sample.rate[2], sample.field
        if self.motion is None:
            if field is not None and self.compass_time_constant:
                self._compass_error(field, 0.0)
            return Motion(0.0, rate)
        yaw, rate_before = self.motion
        self._since_gap += elapsed
        if elapsed > self.gap:
            rate_before = rate  # the one before it may have been the first of a lie
            if 0 < self._headings < FIELDS_AVERAGED:
                self._headings, self._heading_at_zero = FIELDS_AVERAGED, self._heading_at_rest
            self._has_gap, self._since_gap = self._headings > 0, 0
        turned = (rate_before + rate) / 2 * elapsed / SECOND
        yaw += turned if elapsed <= self.gap else math.remainder(turned, math.tau)
        constant = self.compass_time_constant
        if field is not None and constant:
            is_unknown = self._has_gap or elapsed >= constant
            share = 1.0 if is_unknown else elapsed / constant
            self._has_gap = self._has_gap and self._since_gap < CATCHING_UP
            yaw += share * self._compass_error(field, yaw)
        return Motion(yaw, rate)

    def _compass_error(self, field: tuple[float, float, float], yaw: float) -> float:
        """Return compass less estimate, within plus and minus pi; 0 at first."""
        heading = _heading_of(field)
        error = math.remainder(heading - self._heading_at_zero - yaw, math.tau)
        self._headings += 1
        if self._headings > FIELDS_AVERAGED:
            return error
        self._heading_at_zero += error / self._headings
        if self._headings <= FIELDS_AT_REST:
            self._heading_at_rest = self._heading_at_zero
        return 0.0


def _within_half_a_turn(motion: Motion, of_rad: float) -> Motion:
    yaw, rate = motion
    return Motion(of_rad + math.remainder(yaw - of_rad, math.tau), rate)


def gap_of(settings: ControllerSettings) -> int:
    """Ns without a sample that are a gap: GAP, and two periods at the least."""
    return max(GAP, 2 * seconds(settings.period_s))


def heading_check(settings: ControllerSettings) -> CrossCheck[InertialSample, InertialSample]:
    """The gyro's yaw against the compass': either may read what no longer is."""
    stated = settings.compass_check
    windows = (
        Window(seconds(stated.brief_window_s), stated.brief_tolerance_rad),
        Window(seconds(stated.window_s), stated.tolerance_rad),
    )
    return CrossCheck(
        "heading_check",
        CrossCheckSettings(
            quantity="heading (rad, compass less gyro)",
            windows=tuple(sorted(windows)),
            pause=gap_of(settings),
            share=stated.share,
            circle=math.tau,
        ),
        rate=Source(InertialSample, _yaw_rate),
        value=Source(InertialSample, _heading),
    )


def _yaw_rate(sample: InertialSample) -> float:
    return sample.rate[2]


def _heading(sample: InertialSample) -> float | None:
    """Return the compass' heading, rad; None where there is no new field."""
    return None if sample.field is None else _heading_of(sample.field)


def _heading_of(field: tuple[float, float, float]) -> float:
    return atan2(-field[1], field[0])
