"""Position and speed of a body: an inertial unit and a tracking system in the room, fused.

The inertial unit is quick and drifts, the room's positions are true and come late, seldom, or not
at all. A Kalman filter (`position_filter`) goes with the one and is corrected by the other, each
position at the instant it was measured (`position_history`). Memory and time a step are bounded: by
the history's length and by the fixes taken in a step.
"""

from dataclasses import dataclass

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import seconds
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.position_filter import (
    OFF_GATE,
    FilterNoise,
    PositionHistory,
    Span,
    Taken,
)
from firmware_runtime.models.position_fix import (
    FixReport,
    PlanarInertial,
    PoseCovariance,
    PoseFix,
    PositionFix,
    PositionState,
    is_sound,
)

FIXES_A_STEP = 2
"""So many are taken in a step; more are refused, so that a step has a bounded length."""
TOO_MANY = "more than a step takes"
AGREEING = 10
"""So many in a row must be what was expected before one leads back from a lost position."""
UNSOUND = "not finite, or from the future"


@dataclass(frozen=True, slots=True)
class EstimatorSettings:
    """Settings of the estimator: what it knows about its sources."""

    noise: FilterNoise
    gate: float
    """Greatest normalized square of an innovation that is believed."""
    history: int
    """Inertial samples that are kept: how old a position may be."""
    latency: int
    """Ns that every fix is older than it says."""


class PositionEstimator(Atomic):
    """Answers every inertial sample with the motion in x, y and yaw, at the same instant.

    no position --inertial?--> no position
    no position --inertial? with a fix--> estimating (0) --x!, y!, yaw!, ...--> estimated
    estimated --inertial?--> estimating (0) --x!, y!, yaw!, covariance!, report!--> estimated
    any --position?, more than a step takes--> estimating (0) --report!--> as before
    any --state? SAFE--> given up

    Fixes that came since the last sample are taken in with it. Where the position is lost, an
    unexpected one begins the filter again. By itself it says neither where the body is nor that the
    next will agree: nothing is sent of fixes until AGREEING in a row were what was expected.
    A position given up stays so.
    """

    def __init__(self, name: str, settings: EstimatorSettings) -> None:
        super().__init__(name)
        self.inertial = self.in_port("inertial", PlanarInertial)
        self.position = self.in_port("position", PositionFix, takes="any")
        self.pose = self.in_port("pose", PoseFix, takes="any")
        self.state_in = self.in_port("state", PositionState)
        self.x = self.out_port("x", Motion)
        self.y = self.out_port("y", Motion)
        self.yaw = self.out_port("yaw", Motion)
        self.covariance = self.out_port("covariance", PoseCovariance)
        self.report = self.out_port("report", FixReport)
        self.fix = self.out_port("fix", FixReport)
        """Of those that were taken; where the position is lost, once they are believed again."""
        self.settings = settings
        self.history = PositionHistory(settings.history, settings.noise, settings.gate)
        self.taken = 0
        self.refused = 0
        self._refusal = ""
        """Why the last one was refused."""
        self.unexpected = 0
        """How many were too far from where they were expected, refused or not."""
        self._agreeing = 0
        """How many in a row were what was expected, those before the position was lost included."""
        self._state = PositionState.NO_POSITION
        self._now = 0
        self._last: tuple[int, PlanarInertial] | None = None
        self._waiting: list[Taken] = []
        self._reports: list[FixReport] = []
        self._believed: list[FixReport] = []

    def unready(self) -> str | None:
        """Return why there is no position, in a few words; None if there is one."""
        if self.history.state is None:
            refused = f"; {self.refused} came and were refused, the last: {self._refusal}"
            return f"has no position{refused if self.refused else ''}"
        if self._state in {PositionState.LOST, PositionState.SAFE}:
            return f"has lost the position ({self._state.name})"
        return None

    def initialize(self) -> None:
        """Wait for samples and for a position."""
        self.passivate("no position")

    def output(self) -> None:
        """Send the motion, where a sample has come, and what became of the fixes."""
        for report in self._reports:
            self.report.send(report)
        for report in self._believed:
            self.fix.send(report)
        state, last = self.history.state, self._last
        if state is None or last is None or last[0] < self._now:
            return
        position, velocity, _, pp, pv, _, vv, _, bb = state.planar
        self.x.send(Motion(position.real, velocity.real))
        self.y.send(Motion(position.imag, velocity.imag))
        inertial = last[1]
        self.yaw.send(Motion(inertial.yaw_rad + state.offset_rad, inertial.yaw_rate_rad_s))
        self.covariance.send(PoseCovariance(pp, pv.real, vv, bb, state.offset_variance))

    def internal(self) -> None:
        """Wait for the next sample."""
        self._reports, self._believed = [], []
        self._wait()

    def external(self, elapsed: int) -> None:
        """Keep fixes; a sample takes them in."""
        self._now += elapsed
        if self.state_in:
            self._state = self.state_in[-1]
        if self._state is PositionState.SAFE:
            self.passivate("given up")
            return
        fixes: list[PositionFix | PoseFix] = [*self.position, *self.pose]
        for fix in fixes:
            self._keep(fix)
        if self.inertial:
            self._step(self.inertial[-1])
            self.activate("estimating")
        elif self._reports:
            self.activate("estimating")
        else:
            self._wait()

    # ---------------------------------------------------------------------------------------------

    def _wait(self) -> None:
        self.passivate("no position" if self.history.state is None else "estimated")

    def _keep(self, fix: PositionFix | PoseFix) -> None:
        if not is_sound(fix):
            self._refuse(UNSOUND)
        elif len(self._waiting) >= FIXES_A_STEP:
            self._refuse(TOO_MANY)
        else:
            at = self._now - seconds(min(fix.age_s, 1e9)) - self.settings.latency
            may_restart = self._state is PositionState.LOST
            self._waiting.append(Taken(at, fix, may_restart))

    def _refuse(self, reason: str) -> None:
        self._reports.append(FixReport(False, reason, 0.0, 0.0, 0.0, 0.0))
        self._note_refused(reason)

    def _note_refused(self, reason: str) -> None:
        self.refused += 1
        self._refusal = reason

    def _step(self, inertial: PlanarInertial) -> None:
        if self._last is not None and self._last[0] < self._now:
            self.history.add(_span(self._last, (self._now, inertial)))
        self._last = (self._now, inertial)
        reports = self.history.insert(self._waiting)
        self._waiting = []
        for report in reports:
            self._count(report)
            if report.is_taken and (
                self._state is not PositionState.LOST or self._agreeing >= AGREEING
            ):
                self._believed.append(report)
        self._reports += reports

    def _count(self, report: FixReport) -> None:
        if report.is_taken:
            self.taken += 1
        else:
            self._note_refused(report.reason)
        if report.has_begun_again or report.reason == OFF_GATE:
            self.unexpected += 1
            self._agreeing = 0
        elif report.is_taken:
            self._agreeing += 1


def _span(before: tuple[int, PlanarInertial], after: tuple[int, PlanarInertial]) -> Span:
    """From one sample to the next, with the mean of both."""
    (begin, first), (end, last) = before, after
    mean = PlanarInertial(*((a + b) / 2 for a, b in zip(first, last, strict=True)))
    return Span(begin, end, mean)
