"""What happens at an event: expressions evaluated then, and values that hold until the next."""

from collections.abc import Mapping, Sequence

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.models.qss.evaluation import Wires, worth
from firmware_runtime.models.qss.expression import parse
from firmware_runtime.models.qss.program import Layout, compile_expression
from firmware_runtime.models.qss.segment import NANO, Segment


class Assignment(Atomic):
    """At each value at `trigger`, sends what its expressions are worth at that instant.

    waiting --NAME?--> waiting --trigger?--> sending (0) --TARGET!--> waiting

    `values` holds the expression of each output port by its name. `only_if`, an expression, keeps
    it from sending while it is zero. All are evaluated before any is sent.
    """

    def __init__(  # noqa: PLR0913 -- half of them have defaults
        self,
        name: str,
        values: Mapping[str, str],
        inputs: Sequence[str],
        *,
        only_if: str | None = None,
        parameters: Mapping[str, float] | None = None,
        counts: Mapping[str, int] | None = None,
    ) -> None:
        super().__init__(name)
        counts = {each: (counts or {}).get(each, 4) for each in inputs}
        layout = Layout(counts, parameters or {})
        expressions = {**values, **({} if only_if is None else {"": f"1.0 if {only_if} else 0.0"})}
        self._expressions = expressions
        self._programs = {
            target: compile_expression(parse(text), layout, 1)
            for target, text in expressions.items()
        }
        self.trigger = self.in_port("trigger", bool)
        self.inputs = {each: self.in_port(each, Segment) for each in inputs}
        self.outputs = {target: self.out_port(target, Segment) for target in values}
        self._wires = Wires(counts, {})
        self._at = 0
        self._sent: dict[str, float] = {}

    def output(self) -> None:
        """Send the values of this event."""
        for target, value in self._sent.items():
            self.outputs[target].send(Segment(value))

    def internal(self) -> None:
        """Wait for the next event."""
        self._sent = {}
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Keep segments; evaluate at a trigger."""
        self._at += elapsed
        self._wires.advance(elapsed * NANO)
        if self.trigger:
            t, flat = self._at * NANO, self._wires.flat
            values = {name: self._worth(name, t, flat) for name in self._programs}
            if values.pop("", 1.0) != 0.0:
                self._sent = values
        for name, port in self.inputs.items():
            if port:
                self._wires.put(self, name, port[-1])
        if self._sent:
            self.activate("sending")
        else:
            self.passivate("waiting")

    def _worth(self, name: str, t: float, flat: Sequence[float]) -> float:
        try:
            return worth(self._programs[name], t, flat)
        except (ValueError, ArithmeticError) as error:
            text = self._expressions[name]
            raise self._wires.no_value(self, text, self._at, error) from error


class Held(Atomic):
    """A value that changes at events only: a mode, a counter, a level.

    holding --set?--> sending (0) --out!--> holding
    """

    def __init__(self, name: str, initial: float) -> None:
        super().__init__(name)
        self.set = self.in_port("set", Segment)
        self.out = self.out_port("out", Segment)
        self.value = float(initial)

    def initialize(self) -> None:
        """Send the initial value at once."""
        self.activate("sending")

    def output(self) -> None:
        """Send the value."""
        self.out.send(Segment(self.value))

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- it is the same at any time
        """Take the last value in."""
        if self.set:
            self.value = self.set[-1][0]
        self.activate("sending")
