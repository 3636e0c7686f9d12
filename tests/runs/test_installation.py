"""What one board's units have beyond the templates, and which program they start."""

import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.errors import InstallationRefused, StepFailed
from firmware_runtime.host.installation import target as programs_of_units
from firmware_runtime.host.installation.plan import (
    GUARD,
    PROGRAM,
    ROS2,
    RUNTIME,
    device_nodes,
    drop_in,
)
from firmware_runtime.host.installation.target import (
    answer,
    checked,
    own_program,
    refuse_hidden,
    run,
    runnable,
)
from tests.support.recorded_programs import RecordedPrograms

SABERTOOTH = (
    'treads.driver="sabertooth"',
    'treads.port="motors"',
    "treads.address=128",
    "treads.refresh_s=0.1",
    'ports.motors={device="/dev/ttyAMA0", baud=38400}',
)


def lines(service: str, board: str, assignments: Sequence[str] = ()) -> list[str]:
    text = drop_in(service, registry.load(board, assignments), "1.2.3")
    return [line for line in text.splitlines() if not line.startswith("#")]


@pytest.mark.parametrize("board", ["detective", "tachobot"])
def test_a_run_may_open_its_bus_and_keep_the_processor_awake(board: str) -> None:
    assert lines(RUNTIME, board) == [
        "[Service]",
        "LimitRTPRIO=60",
        "DeviceAllow=/dev/i2c-1 rw",
        "TimeoutStartSec=60s",
        "WatchdogSec=2s",
        "DeviceAllow=/dev/cpu_dma_latency w",
    ]


@pytest.mark.parametrize("board", kinds.names())
def test_its_guard_comes_first_and_opens_the_bus_only(board: str) -> None:
    assert lines(GUARD, board) == [
        "[Service]",
        "LimitRTPRIO=61",
        "CPUSchedulingPriority=61",
        "DeviceAllow=/dev/i2c-1 rw",
    ]


def test_the_node_of_ros_opens_the_devices_and_has_no_priority() -> None:
    assert lines(ROS2, "tachobot") == ["[Service]", "DeviceAllow=/dev/i2c-1 rw"]


def test_a_serial_port_is_opened_by_all_three() -> None:
    for service in (RUNTIME, GUARD, ROS2):
        assert "DeviceAllow=/dev/ttyAMA0 rw" in lines(service, "detective", SABERTOOTH)


def test_an_enable_line_is_held() -> None:
    wired = ['output_enable={chip="/dev/gpiochip0", line=17}']
    assert "DeviceAllow=/dev/gpiochip0 rw" in lines(RUNTIME, "tachobot", wired)


def test_every_node_is_named_once() -> None:
    second = 'output_enable={chip="/dev/i2c-1", line=17}'
    assert device_nodes(registry.load("tachobot", [second])) == ["/dev/i2c-1"]


def test_the_guard_of_the_highest_priority_shares_it() -> None:
    highest = ["executive.fifo_priority=99"]
    assert "LimitRTPRIO=99" in lines(RUNTIME, "tachobot", highest)
    assert "CPUSchedulingPriority=99" in lines(GUARD, "tachobot", highest)


@pytest.mark.parametrize("service", [RUNTIME, GUARD])
def test_a_board_that_asks_for_no_priority_gets_none(service: str) -> None:
    asked_for = lines(service, "tachobot", ["executive.fifo_priority=0"])
    assert "LimitRTPRIO=0" in asked_for
    assert ("CPUSchedulingPolicy=other" in asked_for) is (service == GUARD)


def test_a_board_states_how_long_a_start_and_a_step_may_take() -> None:
    slow = lines(RUNTIME, "tachobot", ["executive.bring_up_s=90", "executive.watchdog_s=4.5"])
    assert {"TimeoutStartSec=90s", "WatchdogSec=4.5s"} <= set(slow)


def test_a_board_that_lets_the_processor_sleep_does_not_open_the_request() -> None:
    asleep = ["executive.keep_cpu_awake=false"]
    assert not [line for line in lines(RUNTIME, "tachobot", asleep) if "latency" in line]


@pytest.mark.parametrize(
    "node", ["/dev/i2c 1", "/dev/i2c-%i", "/dev/x\\nExecStart=/bin/sh", "/dev/../etc/shadow"]
)
def test_a_node_that_a_unit_would_misread_is_refused(node: str) -> None:
    board = registry.load("tachobot", [f'buses.i2c1.device="{node}"'])
    with pytest.raises(InstallationRefused, match="cannot stand in a unit; expected a device node"):
        drop_in(RUNTIME, board, "1.2.3")


def test_the_version_that_wrote_it_is_named() -> None:
    text = drop_in(RUNTIME, registry.load("tachobot"), "1.2.3")
    assert text.startswith("# Written by firmware-runtime 1.2.3 from /etc/firmware-runtime/")


SHELL = "/bin/sh"


@pytest.fixture
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RecordedPrograms:
    recorded = RecordedPrograms(tmp_path / "bin")
    monkeypatch.setenv("PATH", str(recorded.directory))
    return recorded


@pytest.mark.parametrize("place", ["/home/pi", "/root", "/run/user/1000"])
def test_a_program_that_a_service_would_not_see_is_refused(place: str) -> None:
    with pytest.raises(InstallationRefused, match="hidden from a service; install it into"):
        checked(f"{place}/venv/bin/firmware-runtime")


@pytest.mark.parametrize("program", ["firmware-runtime", "/opt/my robot/run", "/opt/a\nb", ""])
def test_a_program_that_cannot_stand_in_a_unit_is_refused(program: str) -> None:
    with pytest.raises(InstallationRefused, match="cannot stand in a unit"):
        checked(program)


def test_a_name_that_only_begins_like_a_hidden_place_is_none() -> None:
    refuse_hidden([Path("/homes/firmware-runtime"), Path("/rooted")])


def test_a_program_must_be_there() -> None:
    with pytest.raises(InstallationRefused, match="/opt/none: is no program that can be run"):
        runnable("/opt/none")
    assert runnable(SHELL) == SHELL


def test_an_interpreter_in_a_hidden_place_is_refused_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/home/pi/python/bin/python3")
    with pytest.raises(InstallationRefused, match=r"lies below /(home|root|tmp)"):
        own_program(Path("/usr/lib/rover/definition.py"))


def test_a_board_whose_package_a_service_would_not_see_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(programs_of_units, "HIDDEN", ("/home",))
    with pytest.raises(InstallationRefused, match="/home/pi/rover"):
        own_program(Path("/home/pi/rover/rover/definition.py"))


def test_this_program_is_found_beside_its_interpreter(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(programs_of_units, "HIDDEN", ())
    program = Path(own_program(Path("/usr/lib/rover/definition.py")))
    assert program.name == Path(PROGRAM).name
    assert program.parent == Path(sys.executable).parent


def test_a_command_is_shown_and_run(programs: RecordedPrograms) -> None:
    programs.add("systemctl")
    reported: list[str] = []
    run(("systemctl", "enable", "a b"), reported.append)
    assert reported == ["$ systemctl enable 'a b'"]
    assert programs.calls == ["systemctl enable a b"]


def test_what_a_command_prints_is_its_answer(programs: RecordedPrograms) -> None:
    programs.add("systemctl", out="ActiveState=active\n")
    assert answer(("systemctl", "show")) == "ActiveState=active\n"


def test_a_failing_command_is_explained_in_one_sentence(programs: RecordedPrograms) -> None:
    programs.add("systemctl", error="Job failed.\nSee the journal.\n", status=4)
    with pytest.raises(StepFailed) as raised:
        run(("systemctl", "start", "x"), lambda _: None)
    expected = "systemctl start x: ended with status 4: Job failed. See the journal."
    assert str(raised.value) == expected


def test_a_command_that_is_not_there_is_explained(programs: RecordedPrograms) -> None:
    with pytest.raises(StepFailed, match=r"udevadm: cannot be run .* expected it on the path"):
        run(("udevadm", "trigger"), lambda _: None)
    assert programs.calls == []
