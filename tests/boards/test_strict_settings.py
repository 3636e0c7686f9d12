from typing import Annotated, Any

import pytest
from msgspec import Meta, Struct

from firmware_runtime.board import strict


class Gains(Struct, frozen=True):
    kp: Annotated[float, Meta(ge=0)]
    ki: float = 0.0


class Device(Struct, frozen=True):
    address: int


class Example(Struct, frozen=True):
    name: str
    gains: Gains
    devices: dict[str, Device] = {}
    rows: tuple[Gains, ...] = ()


SOUND: dict[str, Any] = {"name": "a", "gains": {"kp": 1}}


def faults_of(table: dict[str, Any]) -> list[str]:
    faults: list[str] = []
    assert (strict.convert(table, Example, faults) is None) == bool(faults)
    return faults


def test_a_sound_table_becomes_the_schema() -> None:
    table = {**SOUND, "devices": {"imu": {"address": 0x68}}, "rows": [{"kp": 2.5, "ki": 1}]}
    settings = strict.convert(table, Example, [])
    assert settings == Example("a", Gains(1.0), {"imu": Device(0x68)}, (Gains(2.5, 1.0),))


@pytest.mark.parametrize(
    ("change", "key", "reason"),
    [
        ({"nmae": 1}, "nmae:", "unknown key"),
        ({"gains": {"kp": -1}}, "gains.kp:", ">= 0"),
        ({"gains": {"kp": "1"}}, "gains.kp:", "float"),
        ({"gains": {"kp": True}}, "gains.kp:", "float"),
        ({"gains": {"kp": float("nan")}}, "gains.kp:", "finite"),
        ({"gains": {"kp": float("inf")}}, "gains.kp:", "finite"),
        ({"gains": {}}, "gains.kp:", "missing"),
        ({"gains": 3}, "gains:", "a table"),
        ({"devices": {"imu": {"address": 1.5}}}, "devices.imu.address:", "int"),
        ({"rows": [{"kp": 1}, {"kp": "x"}]}, "rows[1].kp:", "float"),
    ],
)
def test_a_fault_names_key_and_reason(change: dict[str, Any], key: str, reason: str) -> None:
    (fault,) = faults_of({**SOUND, **change})
    assert fault.startswith(key)
    assert reason in fault


def test_all_faults_are_found_at_once() -> None:
    faults = faults_of({"gains": {"kp": -1, "kd": 0}, "rows": [{}]})
    assert [fault.split(":")[0] for fault in faults] == [
        "name",
        "gains.kd",
        "gains.kp",
        "rows[0].kp",
    ]


def test_malformed_toml_is_one_fault_with_its_line() -> None:
    faults: list[str] = []
    assert strict.parse_toml("a = 1\nb = = 2\n", faults) == {}
    assert "line 2" in faults[0]


@pytest.mark.parametrize(
    ("assignment", "expected"),
    [
        ("gains.kp=2.5", {"gains": {"kp": 2.5}}),
        ("gains.kp = 0x10", {"gains": {"kp": 16}}),
        ("name=free", {"gains": {}, "name": "free"}),
        ("name=a=b", {"gains": {}, "name": "a=b"}),
        ("new.table.key=[1, 2]", {"gains": {}, "new": {"table": {"key": [1, 2]}}}),
        ('limits."a.b" = [-1, 1]', {"gains": {}, "limits": {"a.b": [-1, 1]}}),
        ("limits.'a.b'.c = 1", {"gains": {}, "limits": {"a.b": {"c": 1}}}),
        ('limits."a = 1', {"gains": {}, "limits": {'"a': 1}}),
    ],
)
def test_an_override_sets_one_key(assignment: str, expected: dict[str, Any]) -> None:
    table: dict[str, Any] = {"gains": {}}
    faults: list[str] = []
    strict.override(table, [assignment], faults)
    assert (table, faults) == (expected, [])


@pytest.mark.parametrize("assignment", ["", "=3", "novalue", "gains.kp.deeper=1"])
def test_an_override_that_fits_nowhere_is_a_fault(assignment: str) -> None:
    faults: list[str] = []
    strict.override({"gains": {"kp": 1}}, [assignment], faults)
    assert len(faults) == 1
