"""Laws that only checked mode watches: it refuses what the fast loop lets pass."""

import random
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.checked import snapshot
from firmware_runtime.devs.model_errors import OutputChangedState, PortTypeError, SentOutsideOutput
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import NEVER
from tests.support.devs_models import Scripted, top


@dataclass(slots=True)
class Filter:
    gain: float = 1.0
    taps: list[float] = field(default_factory=lambda: [0.0, 0.0])


class Plain:
    def __init__(self) -> None:
        self.readings = {"left": [1, 2]}


class Stateful(Scripted):
    """Holds state of many kinds."""

    def __init__(self) -> None:
        super().__init__("model", sigma=5)
        self.count = 0
        self.gain = float("nan")
        self.values = [1, 2]
        self.table: dict[str, Any] = {"a": {"b": [1, {2}]}}
        self.queue = deque([1, 2])
        self.raw = bytearray(4)
        self.array = np.zeros(3)
        self.filter = Filter()
        self.plain = Plain()
        self.noise = random.Random(1)  # noqa: S311 -- reproducible, not secret


CHANGES: dict[str, Callable[[Stateful], object]] = {
    "phase": lambda m: m.hold_in("other", m.sigma),
    "sigma": lambda m: m.hold_in(m.phase, 0),
    "count": lambda m: setattr(m, "count", 1),
    "gain": lambda m: setattr(m, "gain", 1.0),
    "values": lambda m: m.values.append(3),
    "table": lambda m: m.table["a"]["b"][1].add(3),
    "queue": lambda m: m.queue.popleft(),
    "raw": lambda m: m.raw.__setitem__(0, 1),
    "array": lambda m: m.array.__setitem__(1, 2.0),
    "filter": lambda m: m.filter.taps.append(1.0),
    "plain": lambda m: m.plain.readings["left"].pop(),
    "noise": lambda m: m.noise.random(),
    "new": lambda m: setattr(m, "new", 1),
    "first_sigma": lambda m: delattr(m, "first_sigma"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_an_output_function_that_changes_state_is_refused(name: str) -> None:
    model = Stateful()

    def change() -> None:
        CHANGES[name](model)

    model.on_output = change
    simulator = Simulator(top(model), checked=True)
    with pytest.raises(OutputChangedState) as refusal:
        simulator.run(5)
    assert str(refusal.value) == (
        f"top.model at 0.000000005 s: its output function changed {name}; it may only send"
    )


def test_all_changed_attributes_are_named() -> None:
    model = Stateful()

    def change() -> None:
        model.values.append(1)
        model.count += 1

    model.on_output = change
    with pytest.raises(OutputChangedState, match="changed count, values; it may only send"):
        Simulator(model, checked=True).run(5)


def test_an_output_function_that_only_reads_and_sends_is_let_pass() -> None:
    model = Stateful()
    model.on_output = lambda: model.outlet.send(len(model.values))
    simulator = Simulator(model, checked=True)
    received: list[int] = []
    simulator.listen(model.outlet, lambda _at, value: received.append(value))
    simulator.run(5)
    assert received == [2]


def test_transitions_may_change_state_and_without_checked_mode_outputs_too() -> None:
    model = Stateful()

    def transit() -> None:
        for change in CHANGES.values():
            change(model)
        model.passivate()

    model.on_internal = transit
    Simulator(model, checked=True).run(5)
    assert model.values == [1, 2, 3]
    model = Stateful()
    model.on_output = lambda: model.values.append(3)
    Simulator(model).run(5)
    assert model.values == [1, 2, 3]


def test_a_snapshot_of_an_untouched_model_is_equal_to_the_next() -> None:
    model = Stateful()
    assert snapshot(model) == snapshot(model)


def test_state_that_leads_back_to_itself_is_watched_too() -> None:
    model = Stateful()
    model.table["itself"] = model.table
    Simulator(model, checked=True).run(5)
    assert model.calls == [("internal", 0)]


@pytest.mark.parametrize("function", ["on_internal", "on_external"])
def test_sending_in_a_transition_is_refused(function: str) -> None:
    model = Scripted("model", sigma=5 if function == "on_internal" else NEVER)
    setattr(model, function, lambda *_arguments: model.outlet.send(1))
    simulator = Simulator(model, checked=True)
    if function == "on_external":
        simulator.inject(model.inlet, 1)
    with pytest.raises(SentOutsideOutput, match=r"^model at .*: sent on port 'out' outside its"):
        simulator.advance(5)


def test_sending_in_initialize_or_on_another_models_port_is_refused() -> None:
    class Eager(Scripted):
        def initialize(self) -> None:
            self.outlet.send(1)

    with pytest.raises(SentOutsideOutput, match=r"^eager at 0\.000000000 s: sent on port 'out'"):
        Simulator(Eager("eager"), checked=True)
    model, other = Scripted("model", sigma=5), Scripted("other")
    model.on_output = lambda: other.outlet.send(1)
    with pytest.raises(SentOutsideOutput, match=r"^top\.other at .*: sent on port 'out' outside"):
        Simulator(top(model, other), checked=True).run(5)


def test_a_value_of_another_type_is_refused() -> None:
    model = Scripted("model", sigma=5)
    model.on_output = lambda: model.outlet.send("one")  # type: ignore[arg-type]
    with pytest.raises(PortTypeError) as refusal:
        Simulator(top(model), checked=True).run(5)
    assert str(refusal.value) == ("top.model at 0.000000005 s: port 'out' carries int, not 'one'")


def test_a_value_of_a_subclass_and_a_whole_number_for_a_float_are_let_pass() -> None:
    model = Scripted("model", sigma=5)
    model.on_output = lambda: model.outlet.send(True)
    Simulator(top(model), checked=True).run(5)
    assert model.calls == [("internal", 0)]
    model = Scripted("model", sigma=5)
    real = model.out_port("real", float)
    model.on_output = lambda: real.send(1)
    Simulator(model, checked=True).run(5)
    assert model.calls == [("internal", 0)]


def test_instruments_see_the_model_inside_the_checks() -> None:
    class Counting:
        def __init__(self) -> None:
            self.atomics: list[Atomic] = []

        def __call__(self, atomic: Atomic, functions: Any) -> Any:  # noqa: ANN401
            self.atomics.append(atomic)
            return functions

    counting, model = Counting(), Scripted("model", sigma=5)
    Simulator(model, checked=True, instruments=[counting]).run(5)
    assert counting.atomics == [model]
