"""Any nest of coupled models goes through a file and through Python source unchanged."""

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import CouplingError
from firmware_runtime.devs.ports import AnyPort
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.ecdpp.event_file import Event
from firmware_runtime.ecdpp.experiment import run_events
from firmware_runtime.ecdpp.model_file import parse_file
from firmware_runtime.ecdpp.model_writer import model_text
from firmware_runtime.ecdpp.python_source import python_source
from tests.ecdpp.test_model_file import CLASSES, Relay
from tests.support.ecdpp_round_trip import described, executed

NAMES = ("a", "b-c", "class", "self", "name", "Relay", "InOut", "couple", "in", "_x", "top2", "K9")
PORTS = ("In", "out", "name", "add", "in_ports", "X1")


class Nest:
    """Draws models; each name stands for one model, as in a file."""

    def __init__(self, draw: Callable[[st.SearchStrategy[int]], int]) -> None:
        self._draw = draw
        self._names = list(NAMES)

    def below(self, count: int) -> int:
        return self._draw(st.integers(0, count - 1))

    def coupled(self, name: str, depth: int) -> Coupled:
        model = Coupled(name)
        for _ in range(1 + self.below(3)):
            if self._names:
                model.add(self.component(depth))
        for port in PORTS[: self.below(3)]:
            model.in_port(port, float)
        for port in PORTS[: 1 + self.below(3)]:
            model.out_port(port, float)
        for _ in range(self.below(9)):
            self.couple(model)
        return model

    def component(self, depth: int) -> Component:
        name = self._names.pop(self.below(len(self._names)))
        if depth and self.below(2):
            return self.coupled(name, depth - 1)
        return Relay(name, MILLISECOND * (1 + self.below(9)), 1 + self.below(4) / 4)

    def couple(self, model: Coupled) -> None:
        """A wire between ports of float, unless it is none; no way leads back to where it began."""
        parts = list(model.components.values())
        sources: list[AnyPort] = [*model.in_ports.values()]
        sources += [port for part in parts for port in part.out_ports.values()]
        ends: list[AnyPort] = [*model.out_ports.values()]
        ends += [port for part in parts for port in part.in_ports.values()]
        source, end = sources[self.below(len(sources))], ends[self.below(len(ends))]
        if {source.type, end.type} == {float} and self.is_forward(model, source, end):
            try:
                model.couple(source, end)
            except CouplingError:
                return  # twice, or within one model

    @staticmethod
    def is_forward(model: Coupled, source: AnyPort, end: AnyPort) -> bool:
        order = list(model.components)
        begin, last = source.owner.name, end.owner.name
        inner = source.owner is not model and end.owner is not model
        return not inner or order.index(begin) < order.index(last)


@st.composite
def nests(draw: Callable[[st.SearchStrategy[int]], int]) -> Coupled:
    return Nest(draw).coupled("top", 2)


def trace(model: Coupled) -> list[str]:
    events = [
        Event(number * MILLISECOND, port, float(number))
        for number in range(4)
        for port in model.in_ports
    ]
    return [str(line) for line in run_events(model, events)]


@pytest.mark.slow
@settings(max_examples=120, deadline=None)
@given(nests())
def test_a_model_a_file_and_source_of_it_are_one(model: Coupled) -> None:
    text = model_text(model, CLASSES)
    read = parse_file(text, "nest.ma", CLASSES)
    built = executed(python_source(read, "nest.ma"), Path("nest.py"), "Top")
    assert described(read.model) == described(model)
    assert described(built) == described(model)
    assert model_text(read.model, CLASSES) == text
    assert trace(read.model) == trace(built) == trace(model)
