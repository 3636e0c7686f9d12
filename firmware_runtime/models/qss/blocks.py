"""The blocks of a diagram: each is an engine with one part, wired as any atomic model."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from math import floor, inf
from typing import ClassVar

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import AnyPort, InPort
from firmware_runtime.models.qss.engine import Engine, Setting
from firmware_runtime.models.qss.expression import TIME, parse
from firmware_runtime.models.qss.function import TOLERANCE
from firmware_runtime.models.qss.methods import METHODS
from firmware_runtime.models.qss.segment import Segment, Signal, demand_finite
from firmware_runtime.models.qss.watch import INSTANT_S

_ALL: int = 4
"""The coefficients of a segment."""


class Block(Engine):
    """An engine with a port `out`; where that answers inputs at once, it must not feed itself."""

    def __init__(self, name: str, parameters: Mapping[str, float] | None = None) -> None:
        super().__init__(name, parameters)
        self.out = self.out_port("out", Segment)

    def initialize(self) -> None:
        """Begin. Raises ModelError if what it sends comes back to it at once."""
        way = _way(self, self, {self})
        if way is not None:
            names = " -> ".join(each.path for each in (self, *way))
            expected = "expected an integrator or a delay within it"
            raise ModelError(f"an algebraic loop; {expected}", where=names)
        super().initialize()

    @property
    def direct(self) -> tuple[InPort[Segment], ...]:
        """The ports that the output answers at once: all, but of what holds or integrates."""
        return tuple(self.in_ports.values())


def _way(begin: Atomic, end: Atomic, seen: set[Atomic]) -> list[Atomic] | None:
    for following in _fed_at_once(begin):
        if following is end:
            return [end]
        if following not in seen:
            seen.add(following)
            way = _way(following, end, seen)
            if way is not None:
                return [following, *way]
    return None


def _fed_at_once(block: Atomic) -> Iterator[Atomic]:
    for port in block.out_ports.values():
        for reached in _ends(port):
            owner = reached.owner
            direct: Sequence[InPort[object]] = getattr(owner, "direct", ())
            if isinstance(owner, Atomic) and any(reached is each for each in direct):
                yield owner


def _ends(port: AnyPort) -> Iterator[InPort[object]]:
    """The input ports of atomic models to which a port's values get, through coupled ones."""
    scope = port.owner if isinstance(port, InPort) else port.owner.parent
    if isinstance(scope, Coupled):
        for source, destination in scope.couplings:
            if source is port:
                if isinstance(destination, InPort) and isinstance(destination.owner, Atomic):
                    yield destination
                else:
                    yield from _ends(destination)


class Integrator(Block):
    """Sends q whenever it differs from x by the quantum; subclasses say by which method.

    integrating (until |x - q| = quantum) --out!--> integrating
    integrating --derivative?--> integrating | --reset?--> integrating (0)

    `out` carries q; `exact` the exact x whenever its polynomial has changed. The quantum, in the
    unit of x, is `max(quantum, relative_quantum * |x|)`. A value at `reset` becomes x at that
    instant. `steps` counts the segments of q. A step of less than 1 ns is refused with a
    ModelError, as is a derivative of a higher degree than the method takes into account.
    """

    order: ClassVar[int]
    """How many coefficients the segments at `derivative` and `out` have."""

    def __init__(
        self, name: str, initial: float, quantum: float, *, relative_quantum: float = 0.0
    ) -> None:
        super().__init__(name)
        method = METHODS[type(self).__name__]
        self._state = method("x", partial(self.path_of, name), initial, quantum, relative_quantum)
        self.add_state("x", self._state, self.out)
        self.exact = self.exact_signals["x"].way = self.out_port("exact", Segment)
        self.derivative = self.take(
            self.in_port("derivative", Segment), partial(self.derive_by, "x")
        )
        self.reset = self.take(self.in_port("reset", Segment), partial(self.set_by, "x"))

    direct = ()

    @property
    def steps(self) -> int:
        """Number of segments of q there have been."""
        return self._state.steps

    def value_at(self, at: int) -> float:
        """The state x at an instant, in ns, from the last event to the next."""
        return self._state.exact.segment_at(at)[0]


class QSS1(Integrator):
    """First order: q is constant; twice the accuracy takes twice the steps."""

    order = 1


class QSS2(Integrator):
    """Second order: q is a straight line; steps grow with the square root of the quantum."""

    order = 2


class QSS3(Integrator):
    """Third order: q is a parabola; steps grow with the cube root of the quantum."""

    order = 3


class LIQSS2(Integrator):
    """Second order, implicit: a fast stable state does not force its step upon the system."""

    order = 2


class Function(Block):
    """Sends its expression's segment whenever an input came, a term ran out or a condition changed.

    `inputs` are names of ports, with initial values or without; it begins once every input without
    one has sent. `order` coefficients are taken and sent, within `tolerance` in the output's unit.
    Raises ExpressionError, a ModelError, for a text that is not understood, and ModelError where
    what it divides by passes zero.
    """

    def __init__(
        self,
        name: str,
        expression: str,
        inputs: Sequence[str] | Mapping[str, float] = (),
        *,
        order: int = 2,
        tolerance: float = TOLERANCE,
    ) -> None:
        super().__init__(name)
        if order not in {1, 2, 3, _ALL}:
            raise ModelError(f"order is {order!r}", where=self.path, expected="1, 2 or 3")
        if not 0.0 < tolerance < inf:
            raise ModelError(f"tolerance is {tolerance!r}", where=self.path, expected="more than 0")
        initial = inputs if isinstance(inputs, Mapping) else dict.fromkeys(inputs)
        self.inputs = {each: self.add_input(each, order, initial[each]) for each in inputs}
        tree = parse(expression)
        self.add_function(name, tree, self.out, order=order, tolerance=tolerance)


class Sum(Block):
    """The sum of its inputs, each times its weight: `Sum("error", [1.0, -1.0])`."""

    def __init__(self, name: str, weights: Sequence[float]) -> None:
        super().__init__(name)
        if not weights:
            raise ModelError("0 inputs", where=self.path, expected="1 or more")
        terms = []
        for number, weight in enumerate(weights):
            demand_finite(self.path, weight=weight)
            terms.append(f"{float(weight)!r} * in{number}")
        self.inputs = tuple(self.add_input(f"in{number}", _ALL) for number in range(len(weights)))
        self.add_function(name, parse(" + ".join(terms)), self.out, order=_ALL)


class Gain(Sum):
    """Its input times a factor."""

    def __init__(self, name: str, factor: float) -> None:
        super().__init__(name, [factor])


class Product(Function):
    """The product of two inputs, `in0` and `in1`, cut off after `order` coefficients.

    What is cut off is watched as in any `Function`: the product is sent again before it matters.
    """

    def __init__(self, name: str, *, order: int = 2, tolerance: float = TOLERANCE) -> None:
        super().__init__(name, "in0 * in1", ["in0", "in1"], order=order, tolerance=tolerance)


class Sine(Function):
    """`offset + amplitude * sin(2 pi frequency_hz t + phase_rad)`, off by `tolerance` at most."""

    def __init__(  # noqa: PLR0913 -- all but two have defaults
        self,
        name: str,
        frequency_hz: float,
        *,
        amplitude: float = 1.0,
        phase_rad: float = 0.0,
        offset: float = 0.0,
        order: int = 2,
        tolerance: float = TOLERANCE,
    ) -> None:
        parameters = {"amplitude": amplitude, "phase_rad": phase_rad, "offset": offset}
        self.parameters = {"frequency_hz": frequency_hz, **parameters}
        demand_finite(name, **self.parameters)
        text = self.at(TIME)
        super().__init__(name, text, order=order, tolerance=tolerance)

    def at(self, time: str) -> str:
        """Its value at an instant, in s, as an expression."""
        f, a, p, c = (repr(float(each)) for each in self.parameters.values())
        return f"({c} + {a} * sin(tau * {f} * ({time}) + {p}))"


class Crossing(Block):
    """Says when an expression crosses zero: `event` at the instant, `out` on which side it is.

    `out` is 1 above zero and 0 below, sent at the start and at each change; `event` carries True
    for a rise and False for a fall. Inputs may bring up to four coefficients: the port `exact` of
    an integrator, without the error of its quantization. What counts as a crossing: as for a
    `When` of a system.
    """

    def __init__(self, name: str, expression: str, inputs: Sequence[str]) -> None:
        super().__init__(name)
        self.inputs = {each: self.add_input(each, _ALL) for each in inputs}
        self.event = self.out_port("event", bool)
        self.add_event(name, parse(expression), event=self.event, side=self.out, direction="both")


class Hysteresis(Block):
    """On from where its input rises to `upper`, off from where it falls to `lower`.

    off --in reaches upper--> on --in reaches lower--> off; each sends `high` or `low` at `out`
    """

    def __init__(
        self, name: str, lower: float, upper: float, *, low: float = 0.0, high: float = 1.0
    ) -> None:
        super().__init__(name, {"lower": lower, "upper": upper, "low": low, "high": high})
        if not lower < upper:
            raise ModelError(
                f"lower is {lower}", where=self.path, expected=f"less than upper, {upper}"
            )
        self.entrance = self.add_input("u", _ALL, port="in")
        self.add_held("value", low, self.out)
        for reaches, value in (("u - upper", "high"), ("lower - u", "low")):
            only_if = parse(f"value != {value}")
            then = self.setting(name, {"value": parse(value)}, only_if)
            self.add_event(name, parse(reaches), then, happens_at_start=True)


class Switch(Block):
    """`above` while the control input `in` is at or over the threshold, else `below`.

    The wire that is chosen goes through as it is, with all its events.
    """

    def __init__(self, name: str, threshold: float = 0.0) -> None:
        super().__init__(name)
        demand_finite(self.path, threshold=threshold)
        self.entrance = self.add_input("u", _ALL, port="in")
        self.above = self.add_input("above", _ALL, 0.0)
        self.below = self.add_input("below", _ALL, 0.0)
        text = f"above if u >= {float(threshold)!r} else below"
        self.add_function(name, parse(text), self.out, order=_ALL)


class Quantizer(Block):
    """The multiple of `step` below its input, or the nearest one.

    An input that stays at the edge of a step does not make it chatter: it goes back only a
    millionth of the step beyond the edge.
    """

    def __init__(self, name: str, step: float, *, nearest: bool = False) -> None:
        super().__init__(name, {"slack": 1e-6 * step, "step": step})
        if not 0.0 < step < inf:
            raise ModelError(f"step is {step!r}", where=self.path, expected="more than 0")
        self.step = step
        self._offset = 0.5 * step if nearest else 0.0
        self.entrance = self.add_input("u", _ALL, port="in")
        self._bottom = self._add_signal(Signal("bottom", 1, inf))
        text = "max(bottom - slack - u, u - bottom - step)"
        self.add_event(name, parse(text), happens_at_start=True)

    def _happen(self, settings: Sequence[Setting]) -> None:  # noqa: ARG002 -- there is one event
        value, slope, *_ = self.signals["u"].bring(self._at)
        number = (value + self._offset) / self.step
        near = round(number)
        if abs(number - near) * self.step <= INSTANT_S * abs(slope):
            number = near if slope >= 0.0 else near - 1
        bottom = floor(number) * self.step
        self._renew(self._bottom, [bottom - self._offset])
        self._send(self.out, [bottom])


class SampleHold(Block):
    """Sends its input's value at each `trigger`, and holds it until the next.

    waiting --trigger?--> sending (0) --out!--> waiting; --in?--> waiting
    """

    direct = ()

    def __init__(self, name: str, initial: float = 0.0) -> None:
        super().__init__(name)
        self.entrance = self.add_input("u", _ALL, float(initial), port="in")
        self.add_held("value", initial, self.out)
        then = partial(self._trigger, self.setting(name, {"value": parse("u")}))
        self.trigger = self.take(self.in_port("trigger", bool), then)
