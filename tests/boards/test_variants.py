"""Keys that a table's choice rules out are refused; a choice by `--set` takes the file's away."""

from typing import Annotated, Any, Literal, get_args, get_type_hints

import pytest
from msgspec import Struct

from boards.detective.settings import CompassTable, SonarTable, TreadsTable
from boards.tachobot.settings import ControllerSettings
from firmware_runtime.board import registry, strict
from firmware_runtime.board.settings import ModelPolicy
from firmware_runtime.board.variants import foreign_keys, only
from firmware_runtime.errors import ConfigError


class Motor(Struct, frozen=True):
    chip: Literal["i2c", "serial"] = "i2c"
    address: Annotated[int, only("chip", "i2c")] = 1
    port: Annotated[str | None, only("chip", "serial")] = None


class Robot(Struct, frozen=True):
    left: Motor = Motor()
    others: dict[str, Motor] = {}


def faults_of(table: dict[str, Any]) -> list[str]:
    faults: list[str] = []
    strict.convert(table, Robot, faults)
    return faults


def test_keys_of_the_variant_chosen_are_taken() -> None:
    table = {"left": {"address": 3}, "others": {"right": {"chip": "serial", "port": "a"}}}
    settings = strict.convert(table, Robot, [])
    assert settings == Robot(Motor(address=3), {"right": Motor("serial", port="a")})


def test_each_key_of_another_variant_is_a_fault_with_its_reason() -> None:
    faults = faults_of({"left": {"port": "a"}, "others": {"b": {"chip": "serial", "address": 7}}})
    assert faults == [
        "left.port: has no effect; chip is 'i2c', and only 'serial' has such a key",
        "others.b.address: has no effect; chip is 'serial', and only 'i2c' has such a key",
    ]


def test_a_choice_that_is_wrong_itself_is_the_only_fault() -> None:
    (fault,) = faults_of({"left": {"chip": "spi", "address": 3}})
    assert fault.startswith("left.chip: ")


@pytest.mark.parametrize(
    ("board", "assignment", "key"),
    [
        ("detective", "body_sonar.family=hrlv", "body_sonar.family"),
        ("detective", "radar_sonar.port=zz", "radar_sonar.port"),
        ("detective", "treads.port=zz", "treads.port"),
        ("detective", "treads.timeout_s=1.0", "treads.timeout_s"),
        ("tachobot", "controller.x.kp=2.0", "controller.x"),
        ("tachobot", "controller.y.reference_m=1.0", "controller.y"),
        ("tachobot", "overruns.imu.stop_after_us=5.0", "overruns.imu.stop_after_us"),
    ],
)
def test_a_boards_key_without_effect_is_refused(board: str, assignment: str, key: str) -> None:
    with pytest.raises(ConfigError) as refusal:
        registry.load(board, [assignment])
    (fault,) = refusal.value.faults
    assert fault.startswith(f"{key}: has no effect; ")


def test_all_of_them_are_named_at_once() -> None:
    with pytest.raises(ConfigError) as refusal:
        registry.load(
            "detective", ["body_sonar.family=hrlv", "treads.port=zz", "radar_compass.offset=1"]
        )
    assert len(refusal.value.faults) == 3


SERIAL = (
    "treads.driver=sabertooth",
    "treads.port=motors",
    "treads.address=128",
    "treads.refresh_s=0.1",
    "ports.motors={device='/dev/no/motors', baud=9600}",
)


def test_a_variant_chosen_by_an_assignment_takes_the_files_keys_of_the_other_away() -> None:
    table = registry.load("detective", SERIAL).table["treads"]
    assert "bus" not in table
    assert "acceleration" not in table
    assert table["address"] == 128


def test_a_key_that_is_assigned_beside_the_choice_is_judged_all_the_same() -> None:
    with pytest.raises(ConfigError) as refusal:
        registry.load("detective", [*SERIAL, "treads.acceleration=3"])
    (fault,) = refusal.value.faults
    assert fault.startswith("treads.acceleration: has no effect; ")


def test_a_maxbotix_on_a_port_of_another_rate_is_refused() -> None:
    sonar = ("body_sonar.chip=maxbotix", "body_sonar.port=sonar", "body_sonar.period_s=0.2")
    port = "ports.sonar={device='/dev/no/sonar', baud=%d}"
    registry.load("detective", [*sonar, port % 9600])
    with pytest.raises(ConfigError) as refusal:
        registry.load("detective", [*sonar, port % 57600])
    (fault,) = refusal.value.faults
    assert fault.startswith("ports.sonar.baud: 57600; ")


def test_a_policy_that_stops_says_how_late() -> None:
    with pytest.raises(ConfigError) as refusal:
        registry.load("tachobot", ["overruns.imu.policy=stop"])
    (fault,) = refusal.value.faults
    assert fault.startswith("overruns.imu.stop_after_us: missing")


@pytest.mark.parametrize(
    ("schema", "choice"),
    [
        (SonarTable, "chip"),
        (CompassTable, "chip"),
        (TreadsTable, "driver"),
        (ControllerSettings, "mode"),
        (ModelPolicy, "policy"),
    ],
)
def test_every_mark_names_a_choice_and_values_that_there_are(
    schema: type[Struct], choice: str
) -> None:
    hints = get_type_hints(schema, include_extras=True)
    values = get_args(hints[choice])
    table = dict.fromkeys(hints, 0)
    ruled_out = [
        {key for key, _ in foreign_keys({**table, choice: value}, schema)} for value in values
    ]
    marked = set.union(*ruled_out)
    assert marked
    assert not set.intersection(*ruled_out), "a key that no variant has"
