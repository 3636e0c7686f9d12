"""A third board, of one table of `firmware_drivers.tables`: names no chip; both run on doubles."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from firmware_drivers.chips.maxbotix import FAMILIES

from firmware_runtime.board import registry
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.host.doctor.registry import demands_of
from sim_doubles.clock import FollowingClock
from tests.support.installed_here import installed_here

TOML = """board = "bat"
description = "one sonar, of either kind"
[buses.i2c1]
device = "/dev/i2c-1"
speed_hz = 100_000
[ear]
chip = "srf08"
bus = "i2c1"
address = 0x71
period_s = 0.2
threshold_m = 1.0
"""
DEFINITION = """
from firmware_drivers.sonar import Sonar
from firmware_drivers.tables.sonar import SonarTable
from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.faults import Device, SerialDevice
from firmware_runtime.board.faults import bus_loads
from firmware_runtime.board.robot import Robot
from firmware_runtime.board.settings import BoardSettings, BusSettings
from firmware_runtime.devs.coupled import Coupled
from sim_doubles.rigs.board_rig import BoardRig
from sim_doubles.rigs.devices import add_sonar


class BatSettings(BoardSettings, frozen=True, kw_only=True):
    ear: SonarTable
    buses: dict[str, BusSettings] = {}


class Bat(Coupled):
    def __init__(self, settings, lines):
        super().__init__("bat")
        self.start = self.in_port("start", int)
        self.ear = self.add(Sonar("ear", settings.ear.chip(lines), settings.ear.model))
        self.couple(self.start, self.ear.start)


def devices(settings, kind=Device):
    device = settings.ear.device("ear")
    return (device,) if isinstance(device, kind) else ()


def doubles(settings, clock, distance_m):
    rig = BoardRig(settings.buses, clock)
    add_sonar(settings.ear, rig, lambda at: [distance_m])
    return rig


BOARD = BoardDefinition(
    settings=BatSettings,
    build=lambda settings, lines: Robot(model=Bat(settings, lines), probe=(), stop=()),
    devices=devices,
    serial_devices=lambda settings: devices(settings, SerialDevice),
    loads=lambda settings: bus_loads(settings.buses, settings.ear.recurring("ear")),
)
"""
MAXBOTIX = (
    "ear.chip=maxbotix",
    "ear.port=hum",
    "ports.hum={device='/dev/no/hum', baud=9600}",
    "buses={}",
)


@pytest.fixture
def bat(tmp_path: Path) -> Iterator[None]:
    files = {"board.toml": TOML, "definition.py": DEFINITION}
    entries = "[firmware_runtime.boards]\nbat = bat.definition:BOARD\n"
    with installed_here(tmp_path / "site", "bat", files, entries):
        yield


def received(*assignments: str) -> list[object]:
    """What the board's sonar says of an echo 0.75 m away in two seconds: distances, and faults."""
    from bat.definition import doubles  # type: ignore[import-not-found]  # noqa: PLC0415

    from firmware_runtime.board.robot import Lines  # noqa: PLC0415

    board = registry.load("bat", assignments)
    simulators: list[Simulator] = []
    rig = doubles(
        board.settings, FollowingClock(lambda: simulators[0].now if simulators else 0), 0.75
    )
    robot = board.build(Lines(rig.buses, rig.ports))
    simulators.append(Simulator(robot.model, checked=True))
    found: list[object] = []
    for port in ("distance", "fault"):
        simulators[0].listen(
            robot.model.components["ear"].out_ports[port], lambda _at, value: found.append(value)
        )
    simulators[0].inject(robot.model.in_ports["start"], 1)
    simulators[0].run(2 * SECOND)
    return found


@pytest.mark.usefixtures("bat")
@pytest.mark.parametrize(
    "assignments",
    [(), *((*MAXBOTIX, "ear.period_s=0.3", f"ear.family={family}") for family in FAMILIES)],
    ids=["srf08", *FAMILIES],
)
def test_each_chip_and_family_receives_the_same_echo_and_has_no_fault(
    assignments: tuple[str, ...],
) -> None:
    said = received(*assignments)
    assert len(said) >= 4
    assert said == pytest.approx([0.75] * len(said), abs=0.02)


@pytest.mark.usefixtures("bat")
def test_the_board_knows_what_its_chip_asks_of_the_machine() -> None:
    on_i2c, serial = registry.load("bat"), registry.load("bat", MAXBOTIX)
    assert demands_of(on_i2c).stretching == {"/dev/i2c-1": ["srf08"]}
    assert on_i2c.loads["i2c1"].utilisation > 0
    assert (demands_of(serial).ports, serial.devices, serial.loads) == (["/dev/no/hum"], (), {})


@pytest.mark.usefixtures("bat")
@pytest.mark.parametrize(
    ("assignments", "keys"),
    [
        (("ear.chip=maxbotix",), ["ear.port"]),
        (("ear.bus=i2c9", "ports.hum={device='/dev/x', baud=9600}"), ["ear.bus", "buses", "ports"]),
        ((*MAXBOTIX[:2], "buses={}"), ["ear.port"]),
        ((*MAXBOTIX, "ports.hum.baud=57600"), ["ports.hum.baud"]),
        (MAXBOTIX[:3], ["buses.i2c1"]),
        (("ear.family=lv", "ear.gian=3"), ["ear.gian", "ear.family"]),
    ],
)
def test_what_is_wrong_with_its_lines_is_found_without_a_word_of_its_own(
    assignments: tuple[str, ...], keys: list[str]
) -> None:
    with pytest.raises(ConfigError) as refusal:
        registry.load("bat", assignments)
    named = [fault.partition(":")[0] for fault in refusal.value.faults]
    assert len(named) == len(keys)
    assert all(name.startswith(key) for name, key in zip(named, keys, strict=True))
