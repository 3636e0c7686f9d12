"""Keys that a table's choice rules out are refused; a choice by `--set` takes the file's away."""

from typing import Any, ClassVar, TypeAlias

import pytest
from firmware_boards.tachobot.settings import ControllerSettings
from firmware_drivers.tables.compass import CompassTable
from firmware_drivers.tables.sonar import SonarTable, Srf08Table
from firmware_drivers.tables.treads import TreadTable
from msgspec import Struct

from firmware_runtime.board import registry, strict
from firmware_runtime.board.retuning import changed_keys, retuned
from firmware_runtime.board.settings import ModelPolicy
from firmware_runtime.board.variants import variants_of
from firmware_runtime.errors import ConfigError


class Motor(Struct, frozen=True, kw_only=True, tag_field="chip"):
    limit: int = 0


class I2cMotor(Motor, frozen=True, kw_only=True, tag="i2c"):
    is_default_variant: ClassVar[bool] = True
    address: int = 1


class SerialMotor(Motor, frozen=True, kw_only=True, tag="serial"):
    port: str


AnyMotor: TypeAlias = I2cMotor | SerialMotor


class Robot(Struct, frozen=True):
    left: AnyMotor = I2cMotor()
    others: dict[str, AnyMotor] = {}
    spare: AnyMotor | None = None
    rows: tuple[AnyMotor, ...] = ()
    sonar: Srf08Table | None = None


def faults_of(table: dict[str, Any]) -> list[str]:
    faults: list[str] = []
    strict.convert(table, Robot, faults)
    return faults


def test_keys_of_the_variant_chosen_are_taken() -> None:
    table = {"left": {"address": 3}, "others": {"right": {"chip": "serial", "port": "a"}}}
    settings = strict.convert(table, Robot, [])
    assert settings == Robot(I2cMotor(address=3), {"right": SerialMotor(port="a")})


def test_a_variant_may_be_left_out_stand_in_a_list_and_be_the_only_one() -> None:
    sonar = {"chip": "srf08", "bus": "a", "address": 0x71, "period_s": 0.1, "threshold_m": 1}
    table = {"spare": {"chip": "serial", "port": "b"}, "rows": [{"limit": 2}], "sonar": sonar}
    settings = strict.convert(table, Robot, [])
    assert settings is not None
    assert settings.spare == SerialMotor(port="b")
    assert settings.rows == (I2cMotor(limit=2),)
    assert settings.sonar == Srf08Table(bus="a", address=0x71, period_s=0.1, threshold_m=1.0)


def test_a_key_that_only_the_chosen_variant_needs_is_missing_there() -> None:
    (fault,) = faults_of({"left": {"chip": "serial"}})
    assert fault.startswith("left.port: missing; chip 'serial' needs it")


def test_a_choice_without_default_has_to_be_made() -> None:
    (fault,) = faults_of({"sonar": {"bus": "a"}})
    assert fault.startswith("sonar.chip: missing; expected one of srf08")


def test_a_word_like_a_choice_is_suggested() -> None:
    (fault,) = faults_of({"left": {"chip": "seriel"}})
    assert "did you mean serial?" in fault


def test_unknown_keys_and_a_wrong_choice_are_named_together() -> None:
    faults = faults_of({"left": {"chip": [7], "adress": 3, "port": 1}})
    assert [fault.partition(":")[0] for fault in faults] == ["left.adress", "left.chip"]


def test_what_every_variant_has_is_judged_whatever_the_choice() -> None:
    faults = faults_of({"left": {"chip": "spi", "limit": "x", "address": "y"}})
    assert [fault.partition(":")[0] for fault in faults] == ["left.chip", "left.limit"]


def test_all_faults_of_a_variant_are_found_at_once() -> None:
    faults = faults_of({"left": {"chip": "serial", "address": 1, "limit": "x", "prot": "a"}})
    keys = [fault.partition(":")[0] for fault in faults]
    assert keys == ["left.prot", "left.address", "left.limit", "left.port"]


def test_each_key_of_another_variant_is_a_fault_with_its_reason() -> None:
    faults = faults_of(
        {"left": {"port": "a"}, "others": {"b": {"chip": "serial", "port": "c", "address": 7}}}
    )
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


def test_a_change_of_the_choice_is_a_changed_key_and_is_not_taken_up() -> None:
    before, after = Robot(I2cMotor(limit=1)), Robot(SerialMotor(limit=2, port="a"))
    assert set(changed_keys(before, after)) == {
        "left.chip",
        "left.limit",
        "left.address",
        "left.port",
    }
    assert retuned(before, after, ["left.limit"]) == Robot(I2cMotor(limit=2))


@pytest.mark.parametrize(
    ("union", "choice", "tags"),
    [
        (SonarTable, "chip", ["srf08", "maxbotix"]),
        (CompassTable, "chip", ["cmps12", "hmc5883l"]),
        (TreadTable, "driver", ["md25", "sabertooth"]),
        (ControllerSettings, "mode", ["platform", "free", "track"]),
        (ModelPolicy, "policy", ["skip", "catch-up", "stop"]),
    ],
)
def test_every_union_has_one_choice_and_its_tags(
    union: object, choice: str, tags: list[str]
) -> None:
    variants = variants_of(union)
    assert variants is not None
    assert variants.choice == choice
    assert list(variants.schemas) == tags
    assert {each.__struct_config__.tag_field for each in variants.schemas.values()} == {choice}
