"""Coupled models become files that read as the same models, or are refused."""

from collections.abc import Sequence

import pytest
from firmware_boards.detective.detective import ATOMIC_CLASSES, Detective
from firmware_boards.detective.parameters import Parameters

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.ecdpp.atomic_class import AtomicClass
from firmware_runtime.ecdpp.event_file import parse_events
from firmware_runtime.ecdpp.experiment import run_events
from firmware_runtime.ecdpp.model_file import parse_model
from firmware_runtime.ecdpp.model_writer import model_text
from firmware_runtime.errors import ConfigError
from tests.ecdpp.test_model_file import CLASSES, TWO_RELAYS, Relay
from tests.support import figure_6
from tests.support.ecdpp_round_trip import described


class KeepingRelay(Relay):
    """Keeps what no attribute of a Relay is called by."""

    def __init__(self, name: str, delay: int = MILLISECOND) -> None:
        super().__init__(name, delay)


class Choosy(Coupled):
    """Selects by itself."""

    def select(self, imminent: Sequence[Component]) -> Component:
        return imminent[-1]


def faults(model: Coupled, classes: dict[str, AtomicClass] = CLASSES) -> tuple[str, ...]:
    with pytest.raises(ConfigError) as caught:
        model_text(model, classes)
    return caught.value.faults


def with_relay(relay: Atomic, model: Coupled | None = None) -> Coupled:
    made = Coupled("top") if model is None else model
    made.add(relay)
    return made


def test_a_file_that_was_written_reads_as_the_same_model() -> None:
    model = parse_model(TWO_RELAYS, "test.ma", CLASSES)
    text = model_text(model, CLASSES)
    again = parse_model(text, "test.ma", CLASSES)
    assert described(again) == [line.replace("Top", "top") for line in described(model)]
    assert model_text(again, CLASSES) == text


def test_parameters_are_written_as_the_models_have_them() -> None:
    relay = Relay("relay", 3 * SECOND + 20 * MILLISECOND, 1e-7)
    assert model_text(with_relay(relay), CLASSES).splitlines()[-3:] == [
        "[relay]",
        "holdTime : 00:00:03:020",
        "factor : 0.0000001",
    ]


def test_the_detective_plays_figure_6_from_its_exported_file() -> None:
    model = Detective(parameters=Parameters(tolerance_deg=0.5))
    read = parse_model(model_text(model, ATOMIC_CLASSES), "exported.ma", ATOMIC_CLASSES)
    assert described(read) == described(model)
    assert read.components["MovingSystem"].components["compass2"].tolerance_deg == 0.5  # type: ignore[attr-defined]
    events = parse_events(figure_6.EVENTS, "figure 6", read)
    assert "".join(f"{line}\n" for line in run_events(read, events)) == figure_6.OUTPUTS


def test_what_no_file_can_say_is_refused_at_once() -> None:
    model = Choosy("top")
    model.in_port("a b", float)
    model.add(Relay("twin", MILLISECOND + 1))
    inner = model.add(Coupled("inner"))
    inner.add(KeepingRelay("Twin"))
    inner.out_port("y", float)
    inner.out_port("Y", float)
    said = "\n".join(faults(model))
    assert "top.inner.Twin: top.twin is called so too" in said
    assert "top: 'a b': expected letters" in said
    assert "port 'Y' differs from another by case alone" in said
    assert "top: select of its own" in said
    assert "top.twin: hold is 1000001, and holdTime takes whole milliseconds" in said
    assert "top.inner.Twin: class KeepingRelay is known to no model file" in said


def test_a_class_that_keeps_no_attribute_of_a_keywords_name_is_refused() -> None:
    classes = {"Keeping": AtomicClass(KeepingRelay, {"delay": "delay"})}
    (fault,) = faults(with_relay(KeepingRelay("relay")), classes)
    assert fault.startswith("top.relay: no attribute 'delay' to write delay from")


def test_a_port_of_a_type_that_no_coupling_tells_is_refused() -> None:
    model = Coupled("top")
    model.in_port("count", int)
    (fault,) = faults(model)
    assert fault.startswith("top.count: of int, by its couplings of float")
