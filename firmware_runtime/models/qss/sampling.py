"""Blocks between continuous and sampled signals: hold, sample-and-hold, and the two delays."""

from bisect import bisect_right
from math import inf

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.delay import Delay, whole_ns
from firmware_runtime.models.qss.segment import NANO, ZERO_SEGMENT, Segment, whole_after
from firmware_runtime.models.qss.watch import falls_below_zero


class Hold(Atomic):
    """Samples its input every `period` ns and holds the value in between (zero-order hold).

    waiting (until the next sample) --out!--> waiting; --in?--> waiting
    """

    def __init__(self, name: str, period: int) -> None:
        super().__init__(name)
        self.entrance = self.in_port("in", Segment)
        self.out = self.out_port("out", Segment)
        self.direct = (self.entrance,)
        """What the output answers at once: `blocks`."""
        self.period = whole_ns(self, "period", period, least=1)
        self._segment = ZERO_SEGMENT
        self._has_input = False

    def output(self) -> None:
        """Send the value of this instant."""
        self.out.send(Segment(self._segment.at(self.sigma * NANO)))

    def internal(self) -> None:
        """Wait for the next sample."""
        self._segment = self._segment.after(self.sigma * NANO)
        self.hold_in("waiting", self.period)

    def external(self, elapsed: int) -> None:
        """Take a new segment in; the first one is sampled at once."""
        self._segment = self.entrance[-1]
        if self._has_input:
            self.continue_(elapsed)
        else:
            self._has_input = True
            self.hold_in("waiting", 0)


class SegmentDelay(Delay[Segment]):
    """Its input `duration` ns later, exactly; `initial` until the first segment has come through.

    A delayed polynomial is the same polynomial, begun later.
    """

    def __init__(self, name: str, duration: int, initial: float = 0.0) -> None:
        super().__init__(name, Segment, duration)
        self.out = self.delayed
        self.direct = () if self.duration > 0 else (self.entrance,)
        """What the output answers at once: `blocks`."""
        self.initial = float(initial)

    def initialize(self) -> None:
        """Send what was before the start."""
        self.held.append((0, Segment(self.initial)))
        self.hold_in("holding", 0)


class VariableDelay(Atomic):
    """Its input as it was `delay` seconds ago, with the delay a signal; `initial` before the start.

    waiting --in?--> ... --delay?--> sending (0) --out!--> waiting (until a segment boundary)

    With the delay a straight line the result is exact; the output is the input's polynomial at
    t - delay(t), cut off after `order` coefficients. A delay below 0 counts as 0.
    """

    def __init__(
        self, name: str, longest_s: float, *, initial: float = 0.0, order: int = 2
    ) -> None:
        super().__init__(name)
        if not 0.0 < longest_s < inf:
            raise ModelError(f"longest_s is {longest_s}", where=self.path, expected="more than 0")
        self.entrance = self.in_port("in", Segment)
        self.delay = self.in_port("delay", Segment)
        self.out = self.out_port("out", Segment)
        self.direct = (self.delay,)
        """What the output answers at once: `blocks`."""
        self.longest_s, self.order = longest_s, order
        self._at = 0
        self._begins = [-(1 << 62)]
        self._past = [Segment(float(initial))]
        self._delay = ZERO_SEGMENT
        self._segment = ZERO_SEGMENT
        self._next_s = inf
        self._sends = False

    def output(self) -> None:
        """Send the new segment."""
        if self._sends:
            self.out.send(self._segment)

    def internal(self) -> None:
        """Wait for the next boundary, or pass it."""
        if self._sends:
            self._sends = False
            self.sigma = whole_after(self._next_s)
        else:
            self._at += self.sigma
            self._delay = self._delay.after(self.sigma * NANO)
            self._look_back()

    def external(self, elapsed: int) -> None:
        """Remember the input; take a new delay."""
        self._at += elapsed
        self._delay = self.delay[-1] if self.delay else self._delay.after(elapsed * NANO)
        if self.entrance:
            self._remember(self.entrance[-1])
        self._look_back()

    def _remember(self, segment: Segment) -> None:
        if self._begins[-1] == self._at:
            self._past[-1] = segment
        else:
            self._begins.append(self._at)
            self._past.append(segment)
        oldest = bisect_right(self._begins, self._at - int(self.longest_s * SECOND)) - 1
        if oldest > 256:
            del self._begins[:oldest], self._past[:oldest]

    def _look_back(self) -> None:
        """The segment in force at t - delay, as a polynomial of t."""
        d0, d1, d2, _ = self._delay
        if d0 > self.longest_s:
            raise ModelError(
                f"a delay of {d0:.6g} s", where=self.path, expected=f"{self.longest_s:g} s at most"
            )
        if d0 > 0.0:
            counts_until = falls_below_zero(d0, d1, d2)
            counts_until = min(counts_until, falls_below_zero(self.longest_s - d0, -d1, -d2))
        else:
            counts_until = falls_below_zero(-d0, -d1, -d2)
            d0 = d1 = d2 = 0.0
        seen = self._at - d0 * 1e9
        index = bisect_right(self._begins, seen + 1.0) - 1
        segment = self._past[index]
        if index > 0:
            segment = segment.after((seen - self._begins[index]) * NANO)
        a, b, c, _ = segment
        speed = 1.0 - d1
        result = (a, b * speed, c * speed * speed - b * d2)
        self._segment = Segment(*result[: self.order])
        self._next_s = max(min(counts_until, self._boundary(index, d0, d1, d2)), NANO)
        self._sends, self.sigma = True, 0

    def _boundary(self, index: int, d0: float, d1: float, d2: float) -> float:
        """Return when t - delay leaves the segment: at its end, or back over its beginning."""
        leaves = inf
        if index + 1 < len(self._begins):
            ahead = (self._begins[index + 1] - self._at) * NANO + d0
            leaves = falls_below_zero(max(ahead, NANO), d1 - 1.0, d2)
        if index > 0:
            behind = (self._at - self._begins[index]) * NANO - d0
            leaves = min(leaves, falls_below_zero(max(behind, NANO), 1.0 - d1, -d2))
        return leaves
