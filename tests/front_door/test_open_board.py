"""`firmware_runtime.open_board`: a robot in the hands of a test or a notebook."""

import gc
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime import (
    BusAbsent,
    ConfigError,
    HalError,
    RunState,
    ScaledClock,
    StatisticsFileError,
    Strike,
    VirtualClock,
    open_board,
)
from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.board.assignments import assigned, assignments_of
from firmware_runtime.board.local_settings import PLACE
from firmware_runtime.board.registry import Board, load
from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.served.client import ServedDoubles
from firmware_runtime.hal.wire_errors import PortClosed
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.replay.verdict import replay
from firmware_runtime.runs import hardware
from firmware_runtime.runs.arming import Permission
from firmware_runtime.runs.open_board import OpenBoard
from firmware_runtime.runs.open_lines import open_lines
from firmware_runtime.runs.scripted_operator import ScriptedOperator
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.paths import directories
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.rigs.board_rig import DoublesRig, rig_for
from tests.support.second_choice_board import second_choice_board
from tests.support.served_rig import served_rig

TURNING = 1.0
"""Seconds of TachoBot after which its propellers turn."""
REFUSED = FaultScript([NackAddress(times=None)])


def virtual(board: str = "tachobot", **choices: Any) -> OpenBoard:  # noqa: ANN401
    return open_board(board, doubles=True, clock="virtual", **choices)


def descriptors() -> int:
    """How many this process has open."""
    return len([*Path("/proc/self/fd").iterdir()])


def test_robots_that_were_closed_hold_no_descriptor() -> None:
    with virtual() as robot:
        robot.run(0.01)
    before = descriptors()
    gc.disable()
    try:
        for _ in range(3):
            with virtual() as robot:
                robot.run(0.01)
        assert descriptors() == before
    finally:
        gc.enable()


@pytest.mark.slow
def test_a_robot_runs_and_can_be_inspected() -> None:
    with virtual() as robot:
        result = robot.run(10.0)
        assert (result.state, result.at_s) == (RunState.ENDED, 10.0)
        assert robot.result["settled"] is True
        assert robot.world.state(robot.now).yaw_rad == pytest.approx(1.0, abs=0.05)
        assert robot.statistics.models["imu"].skipped == 0
        assert robot.outputs == {"thrust_pairs": 8}


def test_set_overrides_numbers_of_the_board() -> None:
    with virtual(set={"world.mass_kg": 2.5, "controller.mode": "platform"}) as robot:
        assert robot.session.board is robot.board
        assert robot.board.settings.world.mass_kg == 2.5
        assert robot.board.assignments == ["world.mass_kg=2.5", 'controller.mode="platform"']


@pytest.mark.slow
def test_a_robot_that_goes_on_is_the_robot_that_ran_at_once() -> None:
    with virtual() as whole, virtual() as parts:
        at_once = whole.run(2.0)
        in_parts = [parts.run(0.5), parts.run(1.5)]
        assert [each.at_s for each in in_parts] == [0.5, 2.0]
        assert parts.result == whole.result
        assert in_parts[-1].statistics.models == at_once.statistics.models


def test_outputs_are_off_once_it_is_closed() -> None:
    with virtual() as robot:
        robot.run(TURNING)
        assert robot.outputs == {"thrust_pairs": 8}
    assert robot.outputs == {"thrust_pairs": 0}


def test_serial_ports_are_closed_once_it_is(tmp_path: Path) -> None:
    with virtual(str(second_choice_board(tmp_path))) as robot:
        ports = robot.session.hardware.lines.ports
        assert [port.read_available() for port in ports.values()] == [b"", b""]
    for port in ports.values():
        with pytest.raises(PortClosed):
            port.read_available()


def test_outputs_are_off_also_after_an_error_in_the_program() -> None:
    def program() -> None:
        with robot:
            robot.run(TURNING)
            raise LookupError

    robot = virtual()
    with pytest.raises(LookupError):
        program()
    assert robot.outputs == {"thrust_pairs": 0}


@pytest.mark.parametrize("has_run", [True, False])
def test_what_cannot_be_switched_off_is_said(*, has_run: bool) -> None:
    robot = virtual(set={"executive.switch_off_s": 0.0})
    if has_run:
        robot.run(TURNING)
    rig: Any = robot.rig
    rig.buses["i2c1"].faults = REFUSED
    with pytest.raises(HalError, match="not made safe"):
        robot.close()


def test_a_robot_that_is_closed_does_not_run_any_more() -> None:
    with virtual() as robot:
        robot.run(0.1)
    assert robot.close() is None
    with pytest.raises(RuntimeError):
        robot.run(0.1)


@pytest.mark.slow
def test_a_task_that_is_over_ends_the_run() -> None:
    with virtual("detective") as robot:
        result = robot.run()
        assert result.state is RunState.STOPPED
        assert robot.result["found"] is True
        assert robot.outputs is not None
        assert set(robot.outputs.values()) == {0}
        with pytest.raises(RuntimeError):
            robot.run(1.0)


def test_ports_at_any_level_can_be_listened_to() -> None:
    instants: list[int] = []
    with virtual() as robot:
        sample = robot.model.components["imu"].out_ports["sample"]
        with robot.listen(sample, lambda at, _sample: instants.append(at)):
            robot.run(TURNING)
        count = len(instants)
        robot.run(0.1)
    assert 0 < count == len(instants)


def test_a_run_on_doubles_leaves_no_file() -> None:
    before = {path for folder in directories() for path in folder.glob("*")}
    with virtual() as robot:
        robot.run(0.1)
    assert {path for folder in directories() for path in folder.glob("*")} == before


@pytest.mark.parametrize(
    ("board", "choices", "error"),
    [
        ("tachobt", {"doubles": True}, ConfigError),
        ("tachobot", {"doubles": True, "set": {"world.mas_kg": 2.5}}, ConfigError),
        ("tachobot", {"doubles": True, "set": {"world.mass_kg": -2.5}}, ConfigError),
        ("tachobot", {"doubles": True, "set": {"world.mass_kg": object()}}, ConfigError),
        ("tachobot", {"doubles": True, "set": ["world.mass_kg=2.5"]}, ConfigError),
        ("tachobot", {"doubles": None}, ConfigError),
        ("tachobot", {"doubles": True, "arm": "no"}, ConfigError),
        ("tachobot", {"doubles": True, "supervised": 1}, ConfigError),
        ("tachobot", {"doubles": True, "statistics": 3}, ConfigError),
        ("tachobot", {"doubles": True, "log": "log.txt"}, ConfigError),
        ("tachobot", {"clock": "virtual"}, ConfigError),
        ("tachobot", {"clock": VirtualClock()}, ConfigError),
        ("tachobot", {"clock": ScaledClock(2.0)}, ConfigError),
        ("tachobot", {"doubles": True, "clock": "fast"}, ConfigError),
        ("tachobot", {"doubles": True, "clock": "scaled"}, ConfigError),
        ("tachobot", {"doubles": True, "speed": 2.0}, ConfigError),
        ("tachobot", {"doubles": "/no/socket", "clock": "virtual"}, ConfigError),
        ("tachobot", {"doubles": "/no/socket"}, BusAbsent),
        ("tachobot", {"set": {"buses.i2c1.device": "/dev/no-bus"}}, BusAbsent),
        ("tachobot", {"doubles": True, "statistics": "tachobot.socket"}, StatisticsFileError),
    ],
)
def test_what_the_command_refuses_is_refused_here(
    monkeypatch: pytest.MonkeyPatch, board: str, choices: dict[str, Any], error: type[Exception]
) -> None:
    monkeypatch.setattr(hardware, "SERVED_WITHIN_S", 0.05)
    with pytest.raises(error):
        open_board(board, **choices)


def test_values_of_a_program_are_numbers_of_a_board() -> None:
    values = {
        "a": True,
        "b": 2,
        "c": 0.5,
        "d": "x = 1",
        "e": (1, "2"),
        "f": Path("/dev/i2c-1"),
        "g": {"device": "/dev/ttyAMA0", "a b": {}},
    }
    assert assignments_of(values) == [
        "a=true",
        "b=2",
        "c=0.5",
        'd="x = 1"',
        'e=[1, "2"]',
        'f="/dev/i2c-1"',
        'g={"device" = "/dev/ttyAMA0", "a b" = {}}',
    ]
    assert dict(map(assigned, assignments_of(values))) == {
        **values,
        "e": [1, "2"],
        "f": "/dev/i2c-1",
    }


# Outputs outside of this process ----------------------------------------------------------------


@dataclass
class Outside:
    """Robots whose chips are as real as they get here: doubles that no session knows of."""

    rig: DoublesRig | None = None
    reported: list[str] = field(default_factory=list)

    def session(self, *, at_start: bool, statistics_path: Path | None = None) -> Session:
        board = registry.load("tachobot", ["executive.fifo_priority=0"])
        permission = Permission(at_start, demand_guard=False)
        return start_session(
            board,
            VirtualClock(),
            doubles=False,
            statistics_path=statistics_path,
            permission=permission,
            log=self.reported.append,
        )

    def robot(self, *, at_start: bool) -> OpenBoard:
        return OpenBoard(self.session(at_start=at_start), None)

    @property
    def on(self) -> int:
        """How many outputs are on."""
        assert self.rig is not None
        return self.rig.outputs["thrust_pairs"]


@pytest.fixture
def outside(monkeypatch: pytest.MonkeyPatch) -> Outside:
    found = Outside()

    def opened(board: Any, _doubles: None, interlock: Any, time: Any, recorder: Any) -> Any:  # noqa: ANN401
        found.rig = rig_for(board, time)
        return open_lines(board, found.rig, interlock, time, recorder)

    monkeypatch.setattr(hardware, "open_lines", opened)
    return found


def test_outputs_of_a_real_robot_are_not_driven_unless_it_is_armed(outside: Outside) -> None:
    driven: list[int] = []
    with outside.robot(at_start=False) as robot:
        sample = robot.model.components["imu"].out_ports["sample"]
        robot.listen(sample, lambda _at, _sample: driven.append(outside.on))
        robot.run(3.0)
        assert (robot.was_armed, robot.why_not_armed) == (False, "not requested yet")
    assert set(driven) == {0}


class Seen:
    """A hook that notes whether a file is there while a run is under way."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.found: set[bool] = set()

    def between_steps(self, _now: int, _left: int) -> None:
        self.found.add(self.path.exists())


@pytest.mark.parametrize("pauses", [False, True])
def test_what_a_real_robot_drives_by_is_kept_for_others_until_its_outputs_are_off(
    outside: Outside, tmp_path: Path, *, pauses: bool
) -> None:
    session = outside.session(at_start=False, statistics_path=tmp_path / "x.stats")
    kept = Seen(tmp_path / "x.settings")
    session.executive.hooks.append(kept)
    if pauses:
        session.run_on(SECOND // 5)
        assert kept.path.exists()
        session.end()
    else:
        session.run(SECOND // 5)
    assert kept.found == {True}
    assert not kept.path.exists()
    session.close()


@pytest.mark.slow
def test_outputs_of_a_real_robot_are_off_in_a_pause_and_driven_again_after_it(
    outside: Outside,
) -> None:
    driven: list[int] = []
    with outside.robot(at_start=True) as robot:
        sample = robot.model.components["imu"].out_ports["sample"]
        robot.listen(sample, lambda _at, _sample: driven.append(outside.on))
        for _ in range(2):
            driven.clear()
            robot.run(5.0)
            assert driven[-1] == 8
            assert (outside.on, robot.armed, robot.was_armed) == (0, False, True)
    changes = [each for each in outside.reported if not each.startswith("not armed yet: ")]
    assert changes == ["armed", "disarmed: the run pauses"] * 2
    assert outside.on == 0


def test_a_real_robot_that_never_ran_is_switched_off_too(outside: Outside) -> None:
    robot = outside.robot(at_start=True)
    with pytest.raises(ConfigError, match="expected doubles that are made for it"):
        _ = robot.struck
    rig: Any = outside.rig
    before = rig.buses["i2c1"].transactions
    robot.close()
    assert rig.buses["i2c1"].transactions > before
    assert outside.on == 0


def test_a_real_robot_that_cannot_be_switched_off_for_a_pause_is_ended(outside: Outside) -> None:
    robot = outside.robot(at_start=False)
    rig: Any = outside.rig
    robot.run(TURNING)
    rig.buses["i2c1"].faults = REFUSED
    with pytest.raises(HalError):
        robot.run(TURNING)
    rig.buses["i2c1"].faults = None
    with pytest.raises(RuntimeError):
        robot.run(TURNING)


@pytest.mark.parametrize("chip_is_there", [True, False])
def test_doubles_that_are_served_are_left_to_others_afterwards(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, *, chip_is_there: bool
) -> None:
    left: list[str] = []
    with served_rig("tachobot") as served:
        lines = registry.load("tachobot").settings.buses

        def doubles(_board: Board, _path: Path, **_: object) -> ServedDoubles:
            return ServedDoubles(served.ask, lines, (), disconnect=lambda: left.append("left"))

        monkeypatch.setattr(hardware, "served_doubles", doubles)
        served.doubles.buses["i2c1"].faults = None if chip_is_there else REFUSED
        choices: dict[str, Any] = {"doubles": tmp_path, "statistics": tmp_path / "x.stats"}
        if chip_is_there:
            open_board("tachobot", **choices).close()
        else:
            with pytest.raises(HalError):
                open_board("tachobot", **choices)
    assert left == ["left"]
    kept = [] if chip_is_there else ["x.start.recording"]  # what a start that failed has seen
    assert [each.name for each in tmp_path.iterdir()] == kept


def test_a_name_means_the_settings_in_force_on_this_machine(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shipped = kinds.shipped_file("tachobot").read_text()
    assert "mass_kg = 3.0" in shipped
    (tmp_path / "tachobot.toml").write_text(shipped.replace("mass_kg = 3.0", "mass_kg = 2.75"))
    monkeypatch.setenv(PLACE, str(tmp_path))
    reported: list[str] = []
    with virtual(log=reported.append) as robot:
        assert robot.board.settings.world.mass_kg == 2.75
    assert reported == [f"tachobot has its settings from {tmp_path / 'tachobot.toml'}"]


@pytest.mark.slow
def test_a_run_in_stretches_leaves_one_recording_that_replays(tmp_path: Path) -> None:
    path = tmp_path / "run.recording"
    with virtual(record=path) as robot:
        robot.run(1.0)
        robot.run(0.5)
    recording = read_recording(path)
    verdict = replay(recording, board_of(recording.header))
    assert verdict.is_identical
    assert verdict.events > 70  # a tick every 10 ms once the gyro is calibrated, 0.77 s on


def test_an_operator_in_a_script_disarms_and_arms_again_and_that_replays(tmp_path: Path) -> None:
    kept, said = tmp_path / "run.recording", list[str]()
    script = [Strike("disarm", at_s=1.2, for_s=0.3)]
    with open_board(
        "tachobot", doubles=True, clock="virtual", faults=script, record=kept, log=said.append
    ) as robot:
        robot.run(1.19)
        assert (robot.armed, robot.why_not_armed) == (True, None)
        robot.run(0.02)
        assert (robot.armed, robot.why_not_armed) == (False, "its operator disarmed it")
        assert robot.outputs == {"thrust_pairs": 0}
        robot.run(0.35)
        assert robot.armed
        assert robot.outputs != {"thrust_pairs": 0}
        robot.strike("disarm")
        robot.run(0.02)
        assert robot.outputs == {"thrust_pairs": 0}
        robot.clear_faults()
        robot.run(0.2)
        assert robot.armed
    assert said[:2] == ["disarmed: its operator disarmed it", "armed"]
    recording = read_recording(kept)
    assert replay(recording, board_of(recording.header)).is_identical


def test_an_operator_arms_again_once_nothing_in_the_script_disarms_any_more() -> None:
    script = [
        Strike("disarm", at_s=1.1, for_s=0.2),
        Strike("disarm", at_s=1.2, for_s=0.3),
        Strike("disarm", at_s=2.0),
    ]
    with virtual(faults=script) as robot:
        robot.run(1.4)
        assert not robot.armed, "one of two is over"
        robot.run(0.2)
        assert robot.armed
        robot.clear_faults()
        robot.run(1.0)
        assert robot.armed, "what was cleared does not come"


def test_an_operator_has_settings_taken_up_again_at_the_instant_that_is_stated_and_once() -> None:
    with virtual(faults=[Strike("reload", at_s=1.0)]) as robot:
        hooks = robot.session.executive.hooks
        (operator,) = (each for each in hooks if isinstance(each, ScriptedOperator))
        for now, times in ((SECOND - 1, 0), (SECOND, 1), (SECOND + 1, 1)):
            operator.between_steps(now, 0)
            assert robot.session.tuning.revision == times


def test_an_operator_who_disarmed_it_for_good_arms_it_again_once_all_faults_have_an_end() -> None:
    with virtual(faults=[Strike("disarm", at_s=1.1)]) as robot:
        robot.run(1.2)
        robot.session.hardware.struck.end(13 * SECOND // 10)
        robot.run(0.05)
        assert not robot.armed
        robot.run(0.1)
        assert robot.armed


def test_a_folder_whose_name_is_no_text_does_not_keep_its_board_from_being_recorded(
    tmp_path: Path,
) -> None:
    folder, kept = tmp_path / os.fsdecode(b"robot\xff"), tmp_path / "run.recording"
    folder.mkdir()
    (folder / "board.toml").write_text(Path(load("tachobot").source).read_text())
    with open_board(folder, doubles=True, clock="virtual", record=kept) as robot:
        robot.run(0.1)
    assert read_recording(kept).header.source == f"{tmp_path}/robot\\udcff/board.toml"


def test_what_cannot_be_recorded_is_refused_with_nothing_held(tmp_path: Path) -> None:
    with pytest.raises(ConfigError):
        virtual(record=tmp_path / "absent" / "run.recording")
    with pytest.raises(ConfigError):
        virtual(record=3)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_recording_beside_statistics_is_kept_in_a_file_of_its_own_too(tmp_path: Path) -> None:
    kept = tmp_path / "kept.recording"
    with virtual(record=kept, statistics=tmp_path / "run.stats") as robot:
        robot.run(0.1)
    beside, copy = read_recording(tmp_path / "run.recording"), read_recording(kept)
    assert (beside.header, beside.chunks) == (copy.header, copy.chunks)


def test_of_a_robot_that_never_ran_there_is_no_recording(tmp_path: Path) -> None:
    said: list[str] = []
    virtual(record=tmp_path / "run.recording", log=said.append).close()
    assert said == [f"warning: {tmp_path}/run.recording: nothing of this run was recorded"]
    assert list(tmp_path.iterdir()) == []


def test_a_sound_robot_that_still_comes_up_has_not_failed() -> None:
    with open_board("tachobot", doubles=True, clock="virtual") as robot:
        first = robot.run(0.05)
        assert first.state is RunState.ENDED
        assert first.reason.endswith("; so far imu is not up yet")
        assert "so far" not in robot.run(5.0).reason
