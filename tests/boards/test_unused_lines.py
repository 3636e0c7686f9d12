"""A bus or a port that no device is on has no effect, and is refused; on any board."""

import pytest

from firmware_runtime.board import registry
from firmware_runtime.board.faults import unused_lines
from firmware_runtime.board.robot import Lines
from firmware_runtime.board.settings import BoardSettings, BusSettings, PortSettings
from firmware_runtime.errors import ConfigError

BUS = BusSettings("/dev/i2c-1", 100_000.0)
PORT = PortSettings("/dev/ttyS0", 9600)
SPARE_BUS = "buses.spare={device='/dev/i2c-7', speed_hz=100_000}"
SPARE_PORT = "ports.spare={device='/dev/ttyS7', baud=9600}"


class Bare(BoardSettings, frozen=True, kw_only=True):
    """Settings of which one line may be named."""

    board: str = "bare"
    description: str = ""
    bus: str = ""


def faults_of(settings: Bare, *, takes: tuple[str, ...] = ()) -> list[str]:
    def build(lines: Lines) -> None:
        for name in takes:
            lines.buses[name].name  # noqa: B018 -- it is taken, and nothing else

    return [each.partition(":")[0] for each in unused_lines(settings, build)]


@pytest.mark.parametrize(
    ("board", "assignments", "keys"),
    [
        ("tachobot", (SPARE_BUS,), ["buses.spare"]),
        ("detective", (SPARE_BUS, SPARE_PORT), ["buses.spare", "ports.spare"]),
    ],
)
def test_a_line_that_no_device_is_on_is_refused(
    board: str, assignments: tuple[str, ...], keys: list[str]
) -> None:
    with pytest.raises(ConfigError) as refusal:
        registry.load(board, assignments)
    assert [fault.partition(":")[0] for fault in refusal.value.faults] == keys


def test_it_is_named_beside_other_faults() -> None:
    with pytest.raises(ConfigError) as refusal:
        registry.load("detective", [SPARE_BUS, "radar_motor.address=0x70"])
    keys = [fault.partition(":")[0] for fault in refusal.value.faults]
    assert keys == ["radar_motor.address", "buses.spare"]


def test_a_line_counts_as_used_if_a_table_names_it_or_the_wiring_takes_it() -> None:
    settings = Bare(buses={"left": BUS, "right": BUS}, ports={"com": PORT}, bus="left")
    assert faults_of(settings) == ["buses.right", "ports.com"]
    assert faults_of(settings, takes=("right",)) == ["ports.com"]


def test_a_robot_that_cannot_be_built_says_nothing_of_its_lines() -> None:
    assert faults_of(Bare(buses={"left": BUS}), takes=("nowhere",)) == []
