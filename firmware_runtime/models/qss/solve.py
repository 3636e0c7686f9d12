"""A system solved: its blocks simulated, and its outputs read from their polynomials."""

from collections.abc import Callable, Sequence
from numbers import Integral, Real
from typing import Final

from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import seconds as whole_ns
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.qss.expression import names_of
from firmware_runtime.models.qss.model import SystemModel
from firmware_runtime.models.qss.program import Layout, compile_expression
from firmware_runtime.models.qss.segment import NANO
from firmware_runtime.models.qss.system import System
from firmware_runtime.models.qss.watch import worth

_MOST_S: Final = 1e9
"""Thirty years; beyond 292 of them, nanoseconds are more than 64 bits hold."""
_MOST_SAMPLES: Final = 10_000_000
"""More fill the memory before anything is solved."""


class Simulation:
    """A system under way; `advance` brings it to an instant, `values` are its outputs there."""

    def __init__(self, system: System, *, checked: bool = False) -> None:
        self.system = system
        self.model = SystemModel(system)
        trees = {text: self.model.output(text) for text in system.shown}
        self.simulator = Simulator(self.model, checked=checked)
        self.now = 0
        signals = self.model.engine.exact_signals
        self._outputs = {}
        for text, tree in trees.items():
            read = [signals[name] for name in names_of(tree) if name in signals]
            layout = Layout({each.name: 1 for each in read}, system.parameters)
            self._outputs[text] = compile_expression(tree, layout, 1), read

    def advance(self, until: int) -> None:
        """Work off everything up to an instant, in ns."""
        self.simulator.run(until)
        self.now = until

    @property
    def values(self) -> dict[str, float]:
        """The outputs now, by their expressions."""
        now = self.now
        return {
            text: worth(program, now * NANO, [each.segment_at(now)[0] for each in read])
            for text, (program, read) in self._outputs.items()
        }


def solve(
    system: System,
    until: float | None = None,
    *,
    samples: int = 1001,
    times: Sequence[float] | None = None,
    progress: Callable[[int], None] = lambda _: None,
) -> tuple[list[float], dict[str, list[float]]]:
    """Times in s and, by output, the values then: `samples` of them evenly spread, or at `times`.

    The values are those of the states' polynomials, not interpolated. `progress` is called with how
    many instants are done. Raises ConfigError for times that do not ascend from 0 on; ModelError
    where the equations cannot be gone on with.
    """
    if not isinstance(system, System):
        raise ConfigError.of_one("solve", f"{system!r}", expected="a System")
    at = [float(each) for each in times] if times is not None else _spread(until, samples)
    instants = [whole_ns(each) for each in at]
    if instants != sorted(instants) or any(each < 0 for each in instants):
        raise ConfigError.of_one("solve", "times do not ascend", expected="instants from 0 s on")
    simulation = Simulation(system)
    values: dict[str, list[float]] = {text: [] for text in system.shown}
    for done, instant in enumerate(instants, 1):
        simulation.advance(instant)
        for text, value in simulation.values.items():
            values[text].append(value)
        progress(done)
    return at, values


def _spread(until: float | None, samples: int) -> list[float]:
    is_sound = isinstance(until, Real) and 0.0 < until <= _MOST_S
    is_count = isinstance(samples, Integral) and 2 <= samples <= _MOST_SAMPLES
    if until is None or not is_sound or not is_count:
        expected = f"expected more than 0 s, {_MOST_S:g} s at most, 2 to {_MOST_SAMPLES} samples"
        fault = f"until {until!r} s, {samples!r} samples; {expected}"
        raise ConfigError.of_one("solve", fault)
    return [float(until) * number / (samples - 1) for number in range(samples)]
