"""Two sources of one quantity, compared: a gyro against a compass, encoders against a gyro.

A sensor that reads too little, too much or with the wrong sign may be as lively as a sound one;
only another source contradicts it. One source gives the quantity's rate, the other the quantity
itself, up to an offset that does not matter. What is compared is how much each has changed of late:
both changes fade with the time constant `window`, so the bias that every gyro has stays a small
constant (bias times window), and a jump that was right after all is forgiven in time.

Which of the two is wrong is not known: the fault names both.
"""

import math
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

from msgspec import Struct

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.wire_errors import Fault, Implausible

R = TypeVar("R")
V = TypeVar("V")


class CrossCheckSettings(Struct, frozen=True, kw_only=True):
    """Settings: how long changes are remembered, and how far apart they may be."""

    quantity: str
    """What is compared, for the fault: `heading, rad, by gyro against compass`."""
    window: int
    """Time constant in ns with which changes are forgotten."""
    tolerance: float
    """How far apart both changes may be, in the quantity's unit: noise, and what disturbs one."""
    share: float = 0.0
    """And so much of the change more, for sources whose scales differ."""
    circle: float = math.inf
    """Span after which the quantity repeats, as a heading does."""


class Source(NamedTuple, Generic[R]):
    """The type of the values at one port, and what is read of them; None where there is none."""

    type: type[R]
    read: Callable[[R], float | None]


class Comparison:
    """Comparison of both changes: `apart`, of which `most` is believed; `agrees` says so."""

    def __init__(self, settings: CrossCheckSettings) -> None:
        self.settings = settings
        self.agrees = True
        self.apart = 0.0
        """The change of the value less that of the rate, of late."""
        self.most = settings.tolerance
        self._turned = 0.0
        self._rate: float | None = None
        self._value: float | None = None
        self._step = 0.0
        """What the rate makes of the time since the last value."""

    def take_rate(self, rate: float, elapsed: int) -> None:
        """Take a rate, `elapsed` ns after the last one."""
        if self._rate is None or elapsed > self.settings.window:
            self._value = None  # what it did meanwhile is not known
        else:
            self._step += (self._rate + rate) / 2 * elapsed / SECOND
        self._rate = rate

    def take_value(self, value: float, elapsed: int) -> None:
        """Take a value, `elapsed` ns after the last one, and compare."""
        settings, last = self.settings, self._value
        step, self._step = self._step, 0.0
        self._value = value
        if last is None or elapsed > settings.window or self._rate is None:
            return
        more = value - last - step
        if settings.circle < math.inf:
            more = math.remainder(more, settings.circle)
        kept = 1.0 - elapsed / settings.window
        self._turned = kept * self._turned + step
        self.apart = kept * self.apart + more
        self.most = settings.tolerance + settings.share * abs(self._turned)
        self.agrees = abs(self.apart) <= (self.most if self.agrees else self.most / 2)


class CrossCheck(Atomic, Generic[R, V]):
    """Compares `rate` with `value`; `agrees` says when they begin or cease to agree, with a fault.

    waiting --rate?, value?--> waiting, or reporting (0) --agrees!, fault!--> waiting

    They agree at first. Apart by more than the tolerance they do not; they do again from half of it
    on. As long as they do not, the fault is repeated once a window. A source that pauses for a
    window begins a new one, and contradicts nothing.
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
        if not did_agree and self._since_fault < self.settings.window:
            return False
        self._since_fault = 0
        self._fault = self._contradiction()
        return True

    def _contradiction(self) -> Fault:
        found = self.comparison
        expected = f"{found.most:.3g} at most between both"
        error = Implausible(self.path, self.settings.quantity, found.apart, expected)
        return Fault.of(error, 1)._replace(duration=self._disagrees_for)
