"""The two motors behind a motor driver: the world face that every driver chip's double shows.

Between two commands of the chip the speeds are known for all future: each motor's ramp, and the
instant at which the chip's timeout stops both. So nothing runs in the background, and a
world may ask as rarely as it likes: speed and turn are formulas in integers.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from firmware_runtime.devs.time import NEVER, SECOND, format_time
from sim_doubles.clock import Now

if TYPE_CHECKING:
    from sim_doubles.outputs import BrokenOutputs


@dataclass(frozen=True, slots=True)
class Ramp:
    """A speed from instant `since` on: `start`, then a step at `first_at` and after each `period`.

    Speeds are whole numbers in a unit of the chip's; `step` is 1 or more, the last one may be less.
    `turned_before` is the turn up to `since`; instants before that are not valid.
    """

    since: int
    start: int = 0
    target: int = 0
    step: int = 1
    first_at: int = NEVER
    period: int = 1
    turned_before: int = 0

    def speed(self, at: int) -> int:
        """Return the speed at an instant; a step due at that instant is done."""
        return self._speed_after(self._steps(at))

    def turned(self, at: int) -> int:
        """Return the integral of the speed up to `at`, in units times ns."""
        steps = self._steps(at)
        if steps == 0:
            return self.turned_before + self.start * (at - self.since)
        change = self.step if self.target > self.start else -self.step
        waiting = self.start * (self.first_at - self.since)
        plateaus = (steps - 1) * self.start + change * (steps - 1) * steps // 2
        last_step_at = self.first_at + (steps - 1) * self.period
        last = self._speed_after(steps) * (at - last_step_at)
        return self.turned_before + waiting + plateaus * self.period + last

    def next_step_at(self, at: int) -> int:
        """Return the first instant after `at` at which the speed changes."""
        if self.speed(at) == self.target:
            return NEVER
        return self.first_at + self._steps(at) * self.period

    def towards(self, at: int, target: int, step: int, period: int) -> "Ramp":
        """Return the ramp that takes over at `at`; itself if that would change nothing.

        The next step of a ramp under way comes when it would have come. With a period of 0 the
        speed is at its target at once.
        """
        same_steps = (step, period) == (self.step, self.period)
        if target == self.target and (same_steps or self.speed(at) == target):
            return self
        if period == 0:
            return Ramp(at, target, target, turned_before=self.turned(at))
        first_at = self.next_step_at(at)
        if first_at == NEVER:
            first_at = at + period
        return Ramp(at, self.speed(at), target, step, first_at, period, self.turned(at))

    def _steps(self, at: int) -> int:
        """Return how many steps are done at an instant."""
        if at < self.first_at:
            return 0
        needed = -(-abs(self.target - self.start) // self.step)
        return min(needed, (at - self.first_at) // self.period + 1)

    def _speed_after(self, steps: int) -> int:
        moved = min(steps * self.step, abs(self.target - self.start))
        return self.start + moved if self.target > self.start else self.start - moved


class Stretch(NamedTuple):
    """A span, in ns, over which both motors turn evenly."""

    since: int
    until: int
    speeds_rad_s: tuple[float, float]


class MotorPair:
    """Motors 1 and 2, at rest at first; a speed of `full_scale` units is `full_speed_rad_s`.

    `before_change` is called just before a command changes what was to come, with the old future
    still there: a world that advances in it, over `stretches`, misses nothing. Instants are ns, and
    instants before the last change are not valid.
    """

    def __init__(self, at: int, full_scale: int, full_speed_rad_s: float) -> None:
        self.before_change: Callable[[], None] | None = None
        self._rad_per_unit_s = full_speed_rad_s / full_scale
        self._since = at
        self._stops_at = NEVER
        self._ramps = (Ramp(at), Ramp(at))
        self._full_scale = full_scale
        self._broken: BrokenOutputs | None = None
        self._commanded = ((0, 0), 1, 0)

    # World face

    def speeds_rad_s(self, at: int) -> tuple[float, float]:
        """Return how fast the motors turn at an instant."""
        first, second = self.units(at)
        return first * self._rad_per_unit_s, second * self._rad_per_unit_s

    def shares(self, at: int) -> tuple[float, float]:
        """Return the same as shares of full speed, -1 to 1."""
        first, second = self.units(at)
        return first / self._full_scale, second / self._full_scale

    def driven(self, at: int) -> tuple[bool, bool]:
        """Return which motors are driven at an instant: one that runs down its ramp is not."""
        first, second = self._ramps
        is_fed = at < self._stops_at
        return is_fed and first.target != 0, is_fed and second.target != 0

    def turned_rad(self, at: int) -> tuple[float, float]:
        """Return how far the motors have turned since they were made: the exact integral."""
        self._check(at)
        scale, end = self._rad_per_unit_s / SECOND, min(at, self._stops_at)
        first, second = self._ramps
        return first.turned(end) * scale, second.turned(end) * scale

    def stretches(self, since: int, until: int) -> Iterator[Stretch]:
        """Yield the spans of constant speed that fill the time from `since` to `until`."""
        while since < until:
            end = min(until, self.next_change_at(since))
            yield Stretch(since, end, self.speeds_rad_s(since))
            since = end

    def next_change_at(self, at: int) -> int:
        """Return the first instant after `at` at which a speed changes, if no command comes."""
        if at >= self._stops_at:
            return NEVER
        first, second = self._ramps
        return min(first.next_step_at(at), second.next_step_at(at), self._stops_at)

    # The chip's face

    def units(self, at: int) -> tuple[int, int]:
        """Return the speeds at an instant in the chip's unit."""
        self._check(at)
        if at >= self._stops_at:
            return 0, 0
        first, second = self._ramps
        return first.speed(at), second.speed(at)

    def drive(self, at: int, targets: tuple[int, int], step: int, period: int) -> None:
        """Let the speeds go to `targets` from `at` on, `step` units each `period` ns."""
        self._commanded = targets, step, period
        broken = self._broken
        first_target, second_target = targets if broken is None else broken.applied(targets)
        first, second = self._ramps
        ramps = (
            first.towards(at, first_target, step, period),
            second.towards(at, second_target, step, period),
        )
        if ramps != self._ramps:
            self._replace(at, ramps)

    def break_output(self, at: int, kind: str, number: int) -> None:
        """Break one motor from `at` on; what it stands at is the speed that it is on its way to."""
        from sim_doubles.outputs import BrokenOutputs  # noqa: PLC0415 -- of a run with faults

        if self._broken is None:
            self._broken = BrokenOutputs(self._full_scale)
        self._broken.add(kind, number, [each.target for each in self._ramps])
        self._drive_again(at)

    def heal_outputs(self, at: int) -> None:
        """Let both motors follow the chip again."""
        self._broken = None
        self._drive_again(at)

    def _drive_again(self, at: int) -> None:
        """Let the last command have its effect; silence that has stopped the motors ended it."""
        if at < self._stops_at:
            self.drive(at, *self._commanded)

    def halt(self, at: int) -> None:
        """Stop both motors at once; no silence stops them again."""
        first, second = self._ramps
        end = min(at, self._stops_at)
        self._commanded = (0, 0), 1, 0
        halted = Ramp(at, turned_before=first.turned(end))
        self._replace(at, (halted, Ramp(at, turned_before=second.turned(end))))
        self._stops_at = NEVER

    def put_off_stop(self, at: int, stops_at: int) -> bool:
        """Let silence stop the motors at `stops_at` only; True if it has stopped them already."""
        stopped = at >= self._stops_at
        if stopped:
            self.halt(at)
        self._stops_at = stops_at
        return stopped

    def _replace(self, at: int, ramps: tuple[Ramp, Ramp]) -> None:
        self._check(at)
        if self.before_change is not None:
            self.before_change()
        self._since = at
        self._ramps = ramps

    def _check(self, at: int) -> None:
        if at < self._since:
            raise ValueError(
                f"motor pair: read at {format_time(at)}, expected an instant not before the last "
                f"change at {format_time(self._since)}"
            )


class MotorDriverDouble:
    """The world face of a chip that drives such a pair, at its clock's present instant."""

    motors: MotorPair
    _now: Now

    def break_output(self, kind: str, number: int) -> None:
        """Break one motor, until `heal_outputs`."""
        self.motors.break_output(self._now(), kind, number)

    def heal_outputs(self) -> None:
        """Let both motors follow the chip again."""
        self.motors.heal_outputs(self._now())

    @property
    def speeds_rad_s(self) -> tuple[float, float]:
        """Return the speeds of motors 1 and 2 now."""
        return self.motors.speeds_rad_s(self._now())

    def outputs_on(self, at: int) -> int:
        """Return how many motors are driven at an instant: one that runs down its ramp is not."""
        return sum(self.motors.driven(at))

    def levels(self, at: int) -> dict[str, float]:
        """Return the speeds of motors 1 and 2 at an instant, rad/s."""
        return dict(zip("12", self.motors.speeds_rad_s(at), strict=True))

    def next_change_at(self, at: int) -> int:
        """The next step of a ramp, or the instant at which silence stops the motors."""
        return self.motors.next_change_at(at)

    def turned_rad(self, at: int) -> tuple[float, float]:
        """Return how far motors 1 and 2 have turned at `at` since the double was made."""
        return self.motors.turned_rad(at)
