"""Zero-crossing detection: the instant at which an expression of wires changes its sign."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import inf
from typing import Final, Literal

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.errors import ModelError
from firmware_runtime.devs.time import NEVER, format_time
from firmware_runtime.models.qss.evaluation import Watch, Wires, side_of
from firmware_runtime.models.qss.expression import parse
from firmware_runtime.models.qss.program import Layout, compile_condition
from firmware_runtime.models.qss.segment import NANO, Segment, whole_after

__all__ = ["Crossing", "Direction"]

Direction = Literal["rising", "falling", "both"]

_ZENO_GAP: Final = 1000
_SHRINKS: Final = 0.999
"""Gaps in ns that are as short, each by this factor or more shorter than the last, vanish."""
_LEAST_GAP: Final = 10
_MOST_LEAST: Final = 1000
"""Gaps in ns that have no room to shrink any more, and how many of them in a row."""


class Crossing(Atomic):
    """Says when an expression crosses zero: `event` at the instant, `out` on which side it is.

    watching (until the crossing) --out!--> watching --NAME?--> watching

    `out` is 1 above zero and 0 below, sent at the start and at each change; `event` carries True
    for a rise and False for a fall, only those of `direction`. The instant is the root of the
    polynomial, rounded up to whole ns, so that the crossing has happened. Inputs may bring up to
    four coefficients: a port `state` of an integrator, without the error of its quantization.
    Events that come ever closer, less than 1 us apart, accumulate (Zeno): a ModelError.
    Where an event is answered at its own instant by a change that leads back, as of a ball that
    bounces, the value has touched zero and not passed it: that is no second event.
    Nor is it one where a value that its event has set to rest at zero, as of a body that sticks,
    leaves it. `at_zero` says whether one that stands there otherwise is above. One that is zero at
    the start, and may stand there for long, has not crossed yet: where it goes then, by its first
    derivative that is not zero, is an event of that direction; of both directions it starts above.
    """

    def __init__(  # noqa: PLR0913 -- most of them have defaults
        self,
        name: str,
        expression: str,
        inputs: Sequence[str],
        *,
        direction: Direction = "both",
        at_zero: bool = True,
        parameters: Mapping[str, float] | None = None,
        counts: Mapping[str, int] | None = None,
    ) -> None:
        super().__init__(name)
        if direction not in {"rising", "falling", "both"}:
            raise ModelError(
                f"{self.path}: direction {direction!r}; expected rising, falling, both"
            )
        counts = {each: (counts or {}).get(each, 4) for each in inputs}
        layout = Layout(counts, parameters or {})
        conditions = compile_condition(parse(expression), layout, at_zero=at_zero)
        self.expression, self.direction = expression, direction
        self.inputs = {each: self.in_port(each, Segment) for each in inputs}
        self.event = self.out_port("event", bool)
        self.out = self.out_port("out", Segment)
        self._wires = Wires(counts, {})
        self._watch, self._difference = Watch(conditions, has_own=True), conditions[-1]
        self._at = 0
        self._side: bool | None = None
        self._has_crossed = False
        self._is_first = True
        self._leaves = inf
        self._value = 0.0
        self._moves = False
        self._beyond = -1.0
        """How far past zero it was at an event of this instant; negative: there was none."""
        self._has_turned = self._returns = self._rests = False
        self._is_poised = False
        """Whether it has been zero ever since the start."""
        self._events: dict[bool, list[int]] = {True: [], False: []}
        self._least_gaps = {True: 0, False: 0}

    def initialize(self) -> None:
        """Look at once if there is no input to wait for."""
        if self._wires.missing:
            self.passivate("watching")
        else:
            self._look()

    def output(self) -> None:
        """Send the side, and the event unless it is the first look."""
        if not self._has_crossed or self._side is None:
            return
        if self._is_event():
            self.event.send(self._side)
        self.out.send(Segment(1.0 if self._side else 0.0))

    def internal(self) -> None:
        """Go on after an event, or see whether it is one."""
        if self._has_crossed:
            self._beyond = self._value if self._moves and self._is_event() else -1.0
            self._has_crossed = self._is_first = self._has_turned = False
            self.sigma = whole_after(self._leaves)
            return
        self._at += self.sigma
        self._beyond = -1.0
        self._wires.advance(self.sigma * NANO)
        self._look()

    def external(self, elapsed: int) -> None:
        """Take new segments in."""
        self._at += elapsed
        if elapsed > 0:
            self._beyond = -1.0
        self._wires.advance(elapsed * NANO)
        for name, port in self.inputs.items():
            if port:
                self._wires.put(self, name, port[-1])
        if self._wires.missing:
            self.sigma = NEVER
        else:
            self._look()

    def _look(self) -> None:
        t, flat = self._at * NANO, self._wires.flat
        try:
            leaves = self._watch.settle(t, flat)
            g = self._difference.code(t, self._watch.sides, flat)
        except (ValueError, ArithmeticError) as error:
            raise self._wires.no_value(self, self.expression, self._at, error) from error
        if self._side is None:
            self._is_poised = g[0] == 0.0
        side = self._side_at_start(g) if self._is_poised else side_of(self._difference, g)
        if self._side is not None and not self._is_poised:
            side = self._side_as_led(g, side, was=self._side)
        leaves = min(leaves, self._watch.clear_for(-1, t, flat, g, side=side))
        if self._is_poised:
            leaves = max(leaves, NANO)
        self._leaves, self._value, self._moves = leaves, abs(g[0]), any(g)
        if side is self._side and not self._has_crossed:
            self.sigma = whole_after(leaves)
            return
        if self._side is not None and side is not self._side and not self._has_turned:
            self._note_event(rises=side)
        self._side, self._has_crossed, self.sigma = side, True, 0

    def _side_at_start(self, g: Sequence[float]) -> bool:
        """The side of what is zero since the start: the one from which its event is reached.

        It crosses as soon as an input brings a slope, else in the next nanosecond: a ball at rest
        on its floor, whose way is only bent, then has a speed that its event can turn round.
        """
        starts = self.direction != "rising"
        if self._side is None or g[0] == g[1] == 0.0:
            return starts
        self._is_poised = False
        return side_of(self._difference, g)

    def _is_event(self) -> bool:
        """Whether what is sent next is an event, and not only on which side it is."""
        if self._is_first or self._has_turned or self._side is None:
            return False
        return self.direction in {"both", _WORDS[self._side]}

    def _side_as_led(self, g: Sequence[float], side: bool, *, was: bool) -> bool:  # noqa: FBT001
        """The side, but for what is left of an event: where it set the value, and its rounding."""
        if self._beyond >= 0.0 and not any(g):
            self._rests = True
        if self._rests:
            self._rests = not any(g)
            self._has_turned = not self._rests and side is not was
            return was if self._rests else side
        stays = abs(g[0]) <= 2.0 * self._beyond + NANO * abs(g[1])
        if self._beyond >= 0.0 and stays and _leads(g) is (not was):
            self._beyond, self._has_turned, self._returns = -1.0, True, True
            return not was
        if self._returns and side is not was and _leads(g) is was:
            return was
        self._returns = False
        return side

    def _note_event(self, *, rises: bool) -> None:
        """Refuse events of one direction whose gaps shrink to nothing: time would stand still."""
        past = self._events[rises]
        past[:] = [*past[-3:], self._at]
        gaps = [later - sooner for sooner, later in pairwise(past)]
        is_least = gaps[-1:] != [] and gaps[-1] <= _LEAST_GAP
        self._least_gaps[rises] = self._least_gaps[rises] + 1 if is_least else 0
        shrinks = (
            len(gaps) == 3
            and gaps[2] < _ZENO_GAP
            and gaps[2] < _SHRINKS * gaps[1]
            and gaps[1] < _SHRINKS * gaps[0]
        )
        if shrinks or self._least_gaps[rises] >= _MOST_LEAST:
            raise ModelError(
                f"{self.path}: {self.expression} crosses zero ever faster, at "
                f"{format_time(self._at)} {gaps[2]} ns after the last time; "
                "expected events that do not accumulate"
            )


def _leads(g: Sequence[float]) -> bool | None:
    """To which side the value moves; None while it stands."""
    return next((each > 0.0 for each in g[1:] if each != 0.0), None)


_WORDS: Final = {True: "rising", False: "falling"}
