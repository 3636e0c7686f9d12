"""Settings of boards are read strictly: unknown keys, variants, lines without effect."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias

import pytest
from firmware_boards.tachobot.settings import ControllerSettings
from firmware_drivers.tables.compass import CompassTable
from firmware_drivers.tables.sonar import SonarTable, Srf08Table
from firmware_drivers.tables.treads import TreadTable
from msgspec import Meta, Struct

from firmware_runtime.board import registry, strict
from firmware_runtime.board.faults import unused_lines
from firmware_runtime.board.installed import definition, shipped_file
from firmware_runtime.board.retuning import changed_keys, retuned
from firmware_runtime.board.robot import Lines
from firmware_runtime.board.settings import BoardSettings, BusSettings, ModelPolicy, PortSettings
from firmware_runtime.board.variants import variants_of
from firmware_runtime.errors import ConfigError


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


def faults_of(table: dict[str, Any], schema: type[Struct] = Example) -> list[str]:
    faults: list[str] = []
    assert (strict.convert(table, schema, faults) is None) == bool(faults)
    return faults


def keys_of(faults: Iterable[str]) -> list[str]:
    return [fault.partition(":")[0] for fault in faults]


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


def test_all_faults_are_found_at_once_and_malformed_toml_is_one_with_its_line() -> None:
    faults = faults_of({"gains": {"kp": -1, "kd": 0}, "rows": [{}]})
    assert [fault.split(":")[0] for fault in faults] == [
        "name",
        "gains.kd",
        "gains.kp",
        "rows[0].kp",
    ]
    faults = []
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


def robot_faults(table: dict[str, Any]) -> list[str]:
    return faults_of(table, Robot)


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


@pytest.mark.parametrize(
    ("table", "faults"),
    [
        ({"left": {"chip": "serial"}}, "left.port: missing; chip 'serial' needs it"),
        ({"sonar": {"bus": "a"}}, "sonar.chip: missing; expected one of srf08"),
        ({"left": {"chip": "seriel"}}, "left.chip: .*did you mean serial[?]"),
        ({"left": {"chip": "spi", "address": 3}}, "left.chip: "),
        ({"left": {"chip": [7], "adress": 3, "port": 1}}, "left.adress: \n.*left.chip: "),
        # what every variant has is judged whatever the choice
        ({"left": {"chip": "spi", "limit": "x", "address": "y"}}, "left.chip: \nleft.limit: "),
        (
            {"left": {"chip": "serial", "address": 1, "limit": "x", "prot": "a"}},
            "left.prot: \nleft.address: \nleft.limit: \nleft.port: ",
        ),
        (
            {"left": {"port": "a"}, "others": {"b": {"chip": "serial", "port": "c", "address": 7}}},
            (
                "left.port: has no effect; chip is 'i2c', and only 'serial' has such a key\n"
                "others.b.address: has no effect; chip is 'serial', and only 'i2c' has such a key"
            ),
        ),
    ],
)
def test_every_fault_of_a_variant_is_named(table: dict[str, Any], faults: str) -> None:
    found = robot_faults(table)
    for fault, expected in zip(found, faults.split("\n"), strict=True):
        assert re.match(expected, fault), fault


SPARE_BUS = "buses.spare={device='/dev/i2c-7', speed_hz=100_000}"
SPARE_PORT = "ports.spare={device='/dev/ttyS7', baud=9600}"
NODE = "buses.more={device='%s', speed_hz=400_000}"
NO_EFFECT = "has no effect; "


@pytest.mark.parametrize(
    ("board", "assignments", "faults"),
    [
        ("detective", ["body_sonar.family=hrlv"], [f"body_sonar.family: {NO_EFFECT}"]),
        ("detective", ["radar_sonar.port=zz"], [f"radar_sonar.port: {NO_EFFECT}"]),
        ("detective", ["treads.port=zz"], [f"treads.port: {NO_EFFECT}"]),
        ("detective", ["treads.timeout_s=1.0"], [f"treads.timeout_s: {NO_EFFECT}"]),
        ("tachobot", ["controller.x.kp=2.0"], [f"controller.x: {NO_EFFECT}"]),
        ("tachobot", ["controller.y.reference_m=1.0"], [f"controller.y: {NO_EFFECT}"]),
        (
            "tachobot",
            ["overruns.imu.stop_after_us=5.0"],
            [f"overruns.imu.stop_after_us: {NO_EFFECT}"],
        ),
        (
            "detective",
            ["body_sonar.family=hrlv", "treads.port=zz", "radar_compass.offset=1"],
            ["", "", ""],
        ),
        ("tachobot", ["overruns.imu.policy=stop"], ["overruns.imu.stop_after_us: missing"]),
        # lines that no device is on
        ("tachobot", [SPARE_BUS], ["buses.spare: "]),
        ("detective", [SPARE_BUS, SPARE_PORT], ["buses.spare: ", "ports.spare: "]),
        (
            "detective",
            [SPARE_BUS, "radar_motor.address=0x70"],
            ["radar_motor.address: ", "buses.spare: "],
        ),
        # two lines that are one device node: no clash on it would be found
        *(
            (
                "tachobot",
                [NODE % node, "imu.bus='more'"],
                ["buses.more.device: .* that of buses.i2c1"],
            )
            for node in ("/dev/i2c-1", "/dev//i2c-1")
        ),
    ],
)
def test_every_fault_of_a_board_is_named(
    board: str, assignments: list[str], faults: list[str]
) -> None:
    with pytest.raises(ConfigError) as refusal:
        registry.load(board, assignments)
    for fault, expected in zip(refusal.value.faults, faults, strict=True):
        assert re.match(expected, fault), fault
    registry.load("tachobot", [NODE % "/dev/i2c-3", "imu.bus='more'"])


SERIAL = (
    "treads.driver=sabertooth",
    "treads.port=motors",
    "treads.address=128",
    "treads.refresh_s=0.1",
    "ports.motors={device='/dev/no/motors', baud=9600}",
)


def test_a_variant_chosen_by_an_assignment_takes_keys_away_and_others_are_judged() -> None:
    table = registry.load("detective", SERIAL).table["treads"]
    assert "bus" not in table
    assert "acceleration" not in table
    assert table["address"] == 128
    with pytest.raises(ConfigError) as refusal:
        registry.load("detective", [*SERIAL, "treads.acceleration=3"])
    (fault,) = refusal.value.faults
    assert fault.startswith("treads.acceleration: has no effect; ")


def test_a_file_that_is_saved_while_it_is_read_has_the_fingerprint_of_what_was_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = shipped_file("tachobot").read_text()
    path = tmp_path / "board.toml"
    path.write_text(text)
    expected = registry.load(str(path)).fingerprint

    def saved_meanwhile(kind: str) -> object:
        path.write_text(text.replace("kp = 0.75", "kp = 0.5"))
        return definition(kind)

    monkeypatch.setattr(registry, "definition", saved_meanwhile)
    assert registry.load(str(path)).fingerprint == expected


def test_a_maxbotix_on_a_port_of_another_rate_is_refused() -> None:
    sonar = ("body_sonar.chip=maxbotix", "body_sonar.port=sonar", "body_sonar.period_s=0.2")
    port = "ports.sonar={device='/dev/no/sonar', baud=%d}"
    registry.load("detective", [*sonar, port % 9600])
    with pytest.raises(ConfigError) as refusal:
        registry.load("detective", [*sonar, port % 57600])
    (fault,) = refusal.value.faults
    assert fault.startswith("ports.sonar.baud: 57600; ")


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


BUS = BusSettings("/dev/i2c-1", 100_000.0)
PORT = PortSettings("/dev/ttyS0", 9600)


class Bare(BoardSettings, frozen=True, kw_only=True):
    """Settings of which one line may be named."""

    board: str = "bare"
    description: str = ""
    bus: str = ""


def unused_in(settings: Bare, *, takes: tuple[str, ...] = ()) -> list[str]:
    def build(lines: Lines) -> None:
        for name in takes:
            lines.buses[name].name  # noqa: B018 -- it is taken, and nothing else

    return [each.partition(":")[0] for each in unused_lines(settings, build)]


def test_a_line_counts_as_used_if_a_table_names_it_or_the_wiring_takes_it() -> None:
    settings = Bare(buses={"left": BUS, "right": BUS}, ports={"com": PORT}, bus="left")
    assert unused_in(settings) == ["buses.right", "ports.com"]
    assert unused_in(settings, takes=("right",)) == ["ports.com"]
    assert unused_in(Bare(buses={"left": BUS}), takes=("nowhere",)) == []
