"""How a value of a port is written, as `ports` says it, and as a refusal does."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, Literal, NamedTuple

import pytest
from msgspec import Meta, Raw, Struct

from firmware_runtime.board.ends import end_of, robot_of
from firmware_runtime.board.registry import load
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.links.ports.datagrams import Refusal
from firmware_runtime.links.ports.ports import LONGEST_FORM, Ports, entry_of


class Leak(Enum):
    DRY = 0
    WET = 1


class Pilot(NamedTuple):
    depth_m: float
    surge: float = 0.0
    leak: Leak = Leak.DRY


@dataclass(frozen=True)
class Report:
    compartment: str
    leak: Leak
    moisture: Annotated[float, Meta(ge=0)] | None = None
    marks: tuple[int, ...] = ()
    volts: dict[str, float] = field(default_factory=dict)


class Course(Struct, frozen=True):
    to: tuple[float, float]
    by: Literal["surge", "sway"]
    legs: list[Pilot]


class Wide(NamedTuple):
    a_field_with_a_name_of_some_length: Course
    another_field_with_a_name_of_some_length: Course
    yet_another_field_with_a_name_of_some_length: Course
    and_the_last_field_with_a_name_of_some_length: Course


PILOT = '{"depth_m": float, "surge": float = 0.0, "leak": "DRY" | "WET" = "DRY"}'

REPORT = (
    '{"compartment": str, "leak": "DRY" | "WET", "moisture": float | null = null, '
    '"marks": [int, ...] = [], "volts": {str: float} = ...}'
)


@pytest.mark.parametrize(
    ("kind", "form"),
    [
        (float, ""),
        (Leak, '"DRY" | "WET"'),
        (Pilot, PILOT),
        (Report, REPORT),
        (Course, f'{{"to": [float, float], "by": "surge" | "sway", "legs": [{PILOT}, ...]}}'),
    ],
)
def test_a_form_says_what_a_value_is_made_of(kind: type[object], form: str) -> None:
    entry = entry_of(Coupled("model").in_port("port", kind))
    assert entry.form is not None, "such values are read"
    assert entry.text == form


def test_a_long_form_is_cut() -> None:
    form = entry_of(Coupled("model").in_port("port", Wide)).text
    assert (len(form), form[-3:]) == (LONGEST_FORM + 3, "...")


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (b'{"depth_m": 1.0, "leak": "wet"}', "leak: 'wet': expected"),
        (b'{"dept_m": 1.0}', "dept_m: unknown field"),
        (b"true", "True: expected an object"),
    ],
)
def test_a_refusal_says_what_was_expected(value: bytes, said: str) -> None:
    model = Coupled("diver")
    model.in_port("pilot", Pilot)
    with pytest.raises(Refusal) as caught:
        Ports(model).arrival("pilot", Raw(value))
    assert said in str(caught.value)
    assert str(caught.value).endswith(f"; expected {PILOT}")


def test_the_list_has_the_form_of_what_enters_and_of_no_other_port() -> None:
    model = Coupled("diver")
    model.in_port("pilot", Pilot)
    model.in_port("depth", float)
    model.in_port("anything", object)
    model.out_port("report", Report)
    listed = {each["name"]: each.get("value") for each in Ports(model).listing()}
    assert listed == {"pilot": PILOT, "depth": None, "anything": None, "report": None}


def test_a_port_of_the_other_end_is_refused_with_that_end() -> None:
    board = load("tachobot")
    whole = board.unconnected()
    _, part = robot_of(end_of(board, "robot"), whole)
    here = Ports(whole.model).of_part(part, "tachobot.controller")
    with pytest.raises(Refusal, match=r"expected `send tachobot\.controller yaw_reference=VALUE`"):
        here.arrival("yaw_reference", Raw(b"1.0"))
    with pytest.raises(Refusal, match="no such input port of the top model, which has none here"):
        here.arrival("nothing", Raw(b"1.0"))
