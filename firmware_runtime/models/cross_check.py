"""Two sources of one quantity, compared: a gyro against a compass, encoders against a gyro.

A sensor that reads too little, too much or with the wrong sign may be as lively as a sound one;
only another source contradicts it. One source gives the quantity's rate, the other the quantity
itself, up to an offset that does not matter. What is compared is how much each has changed of late:
both changes fade with the time constant of a window, so the bias that every gyro has stays a small
constant (bias times window), and a jump that was right after all is forgiven in time. A short
window finds soon what is far off, and may have a small tolerance, as bias has little time to add
up; a long one finds in the end what is a little off. A value that stands still while the rate goes
on is found sooner than a window can that has to forgive scales which differ (`Standstill`).

Which of the two is wrong is not known: the fault names both.
"""

import math
from collections.abc import Callable
from typing import Final, Generic, NamedTuple, TypeVar

from msgspec import Struct

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.wire_errors import Fault, Implausible

R = TypeVar("R")
V = TypeVar("V")
_AGAIN: Final = 0.5
"""Share of what is believed within which they agree again."""
_HALF: Final = 0.4
"""Share of a circle from which on a leap may be one the other way round: one wrong byte, and the
right one after it, are nothing apart."""
CATCHING_UP: Final = 50 * MILLISECOND
"""Ns after a pause in which nothing is compared: what a busy network kept meanwhile comes at once,
so that the value moves on and no time passes for the rate."""


class Window(NamedTuple):
    """How long changes are remembered, and how far apart they may be."""

    length: int
    """Time constant in ns with which changes are forgotten."""
    tolerance: float
    """How far apart both changes may be, in the quantity's unit: noise, and what disturbs one."""


class Standstill(NamedTuple):
    """How much the rate may make of it while the value stands still, in the quantity's unit.

    For a rate without bias, such as a command's: at rest a bias would add up for as long as it is.
    """

    within: float
    """A value that is no further than this from where it was stands still: its noise."""
    most: float
    """How far apart both changes may be meanwhile."""


class CrossCheckSettings(Struct, frozen=True, kw_only=True):
    """Settings: what is compared, and over which windows."""

    quantity: str
    """What is compared, for the fault: `heading, rad, by gyro against compass`."""
    windows: tuple[Window, ...]
    """The shortest first; one at least."""
    pause: int | None = None
    """Ns between two readings of a source after which it begins anew; None is the shortest window.
    The rate is taken to have changed evenly for up to so long."""
    share: float = 0.0
    """And so much of the change more, for sources whose scales differ."""
    standstill: Standstill | None = None
    """None: a value that stands still is compared as any other."""
    circle: float = math.inf
    """Span after which the quantity repeats, as a heading does."""


class Source(NamedTuple, Generic[R]):
    """The type of the values at one port, and what is read of them; None where there is none."""

    type: type[R]
    read: Callable[[R], float | None]


class Apart:
    """How far `apart` the changes of both are, of which `most` is believed."""

    apart: float
    most: float

    @property
    def excess(self) -> float:
        """How many times what is believed they are apart."""
        return abs(self.apart) / self.most


class Change(Apart):
    """Changes of both in one window."""

    def __init__(self, window: Window, share: float) -> None:
        self.window = window
        self.share = share
        self.forget()

    def forget(self) -> None:
        """Begin again, as if neither had changed."""
        self.apart = 0.0
        """The change of the value less that of the rate, of late."""
        self.most = self.window.tolerance
        self.turned = 0.0
        """The change of the rate."""


class ChangeAtStandstill(Apart):
    """Changes of both since the value last moved."""

    def __init__(self, settings: Standstill) -> None:
        self.within, self.most = settings
        self.forget()

    def forget(self) -> None:
        """Begin again where the value is."""
        self.apart = self._moved = 0.0

    def take(self, moved: float, more: float) -> None:
        """Take how much the value has changed, and how much more than the rate says."""
        self._moved += moved
        self.apart += more
        if abs(self._moved) > self.within:
            self.forget()


class Comparison:
    """Comparison of both changes in each window; `agrees` says whether they do in all of them."""

    def __init__(self, settings: CrossCheckSettings) -> None:
        self.settings = settings
        self.agrees = True
        self.changes = [Change(each, settings.share) for each in settings.windows]
        pause = settings.pause
        self._pause = settings.windows[0].length if pause is None else pause
        still = settings.standstill
        self.still = None if still is None else ChangeAtStandstill(still)
        self._rate: float | None = None
        self._value: float | None = None
        self._step = 0.0
        """What the rate makes of the time since the last value."""
        self._catching_up = 0

    @property
    def worst(self) -> Apart:
        """Return the change of the window, or the standstill, in which they are furthest apart."""
        still = [] if self.still is None else [self.still]
        return max([*self.changes, *still], key=lambda change: change.excess)

    def take_rate(self, rate: float, elapsed: int) -> None:
        """Take a rate, `elapsed` ns after the last one."""
        if self._rate is None or elapsed > self._pause:
            self._value = None  # what it did meanwhile is not known
            self._catching_up = CATCHING_UP
        else:
            if self._catching_up > 0:
                self._catching_up -= elapsed
            self._step += (self._rate + rate) / 2 * elapsed / SECOND
        self._rate = rate

    def take_value(self, value: float, elapsed: int) -> None:  # noqa: C901 -- in one frame: in every control tick
        """Take a value, `elapsed` ns after the last one, and compare."""
        last, step = self._value, self._step
        self._value, self._step = value, 0.0
        did_pause = elapsed > self._pause or self._catching_up > 0
        if last is None or self._rate is None or did_pause:
            if self.still is not None:
                self.still.forget()
            return
        more, circle = value - last - step, self.settings.circle
        if circle < math.inf:
            more = math.remainder(more, circle)
        did_agree = self.agrees
        for change in self.changes:  # in line: it is done in every control tick
            kept = 1.0 - elapsed / change.window.length
            change.turned = kept * change.turned + step
            change.apart = kept * change.apart + more
            if abs(change.apart) > circle / 2 and abs(more) > _HALF * circle:
                change.apart -= math.copysign(circle, change.apart)
            change.most = change.window.tolerance + change.share * abs(change.turned)
            if abs(change.apart) > change.most:
                self.agrees = False
        if self.still is not None:
            self.still.take(more + step, more)
            if self.still.excess > 1.0:
                self.agrees = False
                return
        if not did_agree and self.changes[0].excess <= _AGAIN:
            self.agrees = True
            for change in self.changes:
                change.forget()


class CrossCheck(Atomic, Generic[R, V]):
    """Compares `rate` with `value`; `agrees` says when they begin or cease to agree, with a fault.

    waiting --rate?, value?--> waiting, or reporting (0) --agrees!, fault!--> waiting

    They agree at first. Apart by more than the tolerance of any window, or of a standstill, they do
    not; they do again from half of that of the shortest one on, and where the value moves, and all
    windows begin again. As long as they do not, the fault is repeated once a shortest window. A
    source that pauses for too long begins anew, and contradicts nothing.
    """

    def __init__(
        self, name: str, settings: CrossCheckSettings, rate: Source[R], value: Source[V]
    ) -> None:
        super().__init__(name)
        self.rate = self.in_port("rate", rate.type)
        self.value = self.in_port("value", value.type)
        self.agrees_out = self.out_port("agrees", bool)
        self.fault = self.out_port("fault", Fault)
        self.settings = settings
        self.comparison = Comparison(settings)
        self._read_rate, self._read_value = rate.read, value.read
        self._since_rate = self._since_value = 0
        self._disagrees_for = self._since_fault = 0
        self._fault: Fault | None = None

    def initialize(self) -> None:
        """Wait for both sources."""
        self.passivate("waiting")

    def output(self) -> None:
        """Send whether they agree, and the fault if they do not."""
        self.agrees_out.send(self.comparison.agrees)
        if self._fault is not None:
            self.fault.send(self._fault)

    def internal(self) -> None:
        """Wait on."""
        self._fault = None
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take what came; compare with every value."""
        self._since_rate += elapsed
        self._since_value += elapsed
        rate = self._read_rate(self.rate[-1]) if self.rate else None
        value = self._read_value(self.value[-1]) if self.value else None
        if rate is not None:
            self.comparison.take_rate(rate, self._since_rate)
            self._since_rate = 0
        if value is not None and self._compare(value):
            self.activate("reporting")
        else:
            self.passivate("waiting")

    # ---------------------------------------------------------------------------------------------

    def _compare(self, value: float) -> bool:
        """Compare; True if there is something to say."""
        comparison, elapsed, self._since_value = self.comparison, self._since_value, 0
        did_agree = comparison.agrees
        comparison.take_value(value, elapsed)
        if comparison.agrees:
            self._disagrees_for = 0
            return not did_agree
        self._disagrees_for += elapsed
        self._since_fault += elapsed
        if not did_agree and self._since_fault < self.settings.windows[0].length:
            return False
        self._since_fault = 0
        self._fault = self._contradiction()
        return True

    def _contradiction(self) -> Fault:
        found = self.comparison.worst
        expected = f"{_at_most(found.most)} at most between both"
        if found.excess <= 1.0:  # they were further apart before
            found = self.comparison.changes[0]
            expected = f"{_at_most(_AGAIN * found.most)} at most to agree again"
        error = Implausible(self.path, self.settings.quantity, found.apart, expected)
        return Fault.of(error, 1)._replace(duration=self._disagrees_for)


def _at_most(most: float) -> str:
    """A limit in three digits, never rounded to more: what is found beyond it would be within."""
    mantissa, exponent = f"{most:.8e}".split("e")
    return f"{float(f'{mantissa[:4]}e{exponent}'):g}"
