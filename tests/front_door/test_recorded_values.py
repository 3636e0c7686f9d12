"""Values of a run's ports in a program: of a robot of `open_board`, and of what it recorded."""

import os
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime import ConfigError, OpenBoard, UnknownName, open_board, open_recording
from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.motion import Motion
from firmware_runtime.recording.blackbox.locations import recording_of_virtual_run
from firmware_runtime.statistics.port_values import PortValues, table_of
from tests.support.command import Command

PANDAS: Any = import_module("pandas")
YAW, COMMAND, SAMPLE = "controller.attitude.yaw", "controller.yaw.command_n", "imu.sample"


def opened(record: Path | None, **settings: object) -> OpenBoard:
    return open_board("tachobot", doubles=True, clock="virtual", record=record, set=settings)


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, OpenBoard]:
    """A recording of two seconds, and the robot of it, which is closed."""
    path = tmp_path_factory.mktemp("flown") / "step.recording"
    with opened(path) as robot:
        robot.plan(1.5, robot.model.in_ports["yaw_reference"], 0.5)
        robot.run(2.0)
    return path, robot


def same(one: PortValues[Any], other: PortValues[Any]) -> bool:
    return (one.times_ns(), one.values()) == (other.times_ns(), other.values())


def test_a_port_of_a_recorded_robot_has_what_passed_before_it_was_asked_for(tmp_path: Path) -> None:
    with opened(tmp_path / "x.recording") as robot:
        early = robot.port("controller.forces")
        robot.run(1.0)
        late, world = robot.port("controller.allocation.forces"), robot.port("world.x")
        assert len(late) > 10
        robot.run(1.0)
        assert same(early, late), "the coupled model's port sends what the atomic one's does"
        assert same(late, robot.values()["controller.allocation.forces"])
    assert isinstance(world.values()[0], Motion)
    assert repr(late).startswith("<PortValues controller.allocation.forces: ")
    assert "of Forces" in repr(late)


def test_all_values_are_those_that_a_listener_sees(tmp_path: Path) -> None:
    seen: dict[str, list[tuple[int, object]]] = {}

    def noting(path: str) -> Callable[[int, object], None]:
        return lambda at, value: seen.setdefault(path, []).append((at, value))

    with opened(tmp_path / "x.recording") as robot:
        assert robot.values() == {}, "nothing has passed yet"
        for path in (YAW, COMMAND, SAMPLE, "world.yaw_rad", "world.y"):
            *names, port = path.split(".")
            component: Any = robot.model
            for name in names:
                component = component.components[name]
            robot.listen(component.out_ports[port], noting(path))
        robot.run(1.0)
        found = robot.values()
        assert found[SAMPLE].values() == [value for _, value in seen[SAMPLE]]
        robot.run(1.0)
    closed = robot.values()
    for path, passed in seen.items():
        assert [*zip(closed[path].times_ns(), closed[path].values(), strict=True)] == passed
    assert len(closed[SAMPLE]) > len(found[SAMPLE])


def test_a_recording_has_the_same_values_by_its_file_and_by_its_board(
    flown: tuple[Path, OpenBoard],
) -> None:
    path, robot = flown
    recorded = open_recording(path)
    assert (recorded.path, recorded.faults, recorded.board.name) == (path, [], "tachobot")
    for name in (YAW, COMMAND, SAMPLE, "yaw_reference", "controller.forces"):
        assert same(recorded.port(name), robot.port(name))
    assert recorded.port("yaw_reference").values() == [0.5]
    assert recorded.values().keys() == robot.values().keys() <= {*recorded.ports}
    assert recorded.port("imu.fault").values() == [], "one that sent nothing"
    with pytest.raises(UnknownName, match=f"did you mean {COMMAND}"):
        recorded.port("controller.yaw.comand_n")
    assert repr(recorded) == f"<RecordedRun of tachobot: 0 s to 2 s, {path}>"


def test_the_last_run_of_a_board_is_meant_by_its_name(command: Command) -> None:
    run = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", 1)
    assert command(*run).status == 0
    assert open_recording("tachobot").path == recording_of_virtual_run("tachobot")
    with pytest.raises(ConfigError, match="does not exist"):
        open_recording("no/such.recording")


def test_a_table_has_a_row_for_each_instant_and_a_column_for_each_part(
    flown: tuple[Path, OpenBoard],
) -> None:
    path, robot = flown
    frame = robot.to_dataframe()
    assert frame.index.name == "t_s"
    assert frame.index.is_monotonic_increasing
    sample = robot.port(SAMPLE)
    column = frame[f"{SAMPLE}.rate.2"].dropna()
    assert column.index.tolist() == sample.times_s()
    assert column.tolist() == [each.rate[2] for each in sample.values()]
    assert frame[COMMAND].dropna().tolist() == robot.port(COMMAND).values()
    assert frame["yaw_reference"].dropna().to_dict() == {1.5: 0.5}
    own = [name for name in frame.columns if not name.startswith("world.")]
    PANDAS.testing.assert_frame_equal(open_recording(path).to_dataframe()[own], frame[own])


def test_a_port_that_sends_twice_at_an_instant_has_two_rows_then() -> None:
    twice = PortValues("a.x", "int", [(SECOND, 1), (SECOND, 2), (2 * SECOND, 3)])
    once = PortValues("b.y", "float", [(SECOND, 0.5), (3 * SECOND, 1.5)])
    frame = table_of({"a.x": twice, "b.y": once})
    assert frame.index.tolist() == [1.0, 1.0, 2.0, 3.0]
    assert frame["a.x"].dropna().tolist() == [1, 2, 3]
    assert frame["b.y"].dropna().tolist() == [0.5, 1.5]
    assert frame["b.y"].iloc[1] != frame["b.y"].iloc[1], "nothing, beside the second"
    assert table_of({}).empty


@pytest.mark.parametrize("record", [None, "x.recording"])
def test_a_robot_that_is_not_recorded_says_how_it_would_be(
    tmp_path: Path, record: str | None
) -> None:
    settings = {} if record is None else {"recording.minutes": 0}
    with opened(None if record is None else tmp_path / record, **settings) as robot:
        robot.run(1.0)
        samples = robot.port(SAMPLE)
        for ask in (robot.values, robot.to_dataframe):
            with pytest.raises(ConfigError, match="nothing of this run is recorded") as refused:
                ask()
            assert "record=FILE" in str(refused.value)
        assert len(samples) == 0, "what came before is not known"
        robot.run(1.0)
        assert len(samples) == 100


def test_a_robot_of_a_program_is_recorded_as_any_run(
    flown: tuple[Path, OpenBoard], command: Command, tmp_path: Path
) -> None:
    path, robot = flown
    replayed = command("replay", path)
    assert (replayed.status, replayed.out.startswith("identical")) == (0, True)
    table = tmp_path / "x.csv"
    assert command("export", path, "-o", table, "--port", COMMAND).status == 0
    rows = table.read_text().splitlines()[1:]
    assert [float(row.split(",")[-1]) for row in rows] == robot.port(COMMAND).values()
    debugged = command("debug", path, "--at", "1.5", "--print", COMMAND)
    assert debugged.status == 0, debugged.error
    at = robot.port(COMMAND).times_s().index(1.5)
    assert str(robot.port(COMMAND).values()[at]) in debugged.out


WITHOUT = """
import sys
for name in ("pandas", "numpy"):
    sys.modules[name] = None
from firmware_runtime.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.slow
def test_parquet_takes_pyarrow_and_nothing_else(
    flown: tuple[Path, OpenBoard], tmp_path: Path
) -> None:
    table = tmp_path / "x.parquet"
    words = [sys.executable, "-c", WITHOUT, "export", str(flown[0]), "-o", str(table)]
    subprocess.run(words, check=True, env=os.environ, stdout=subprocess.DEVNULL)
    frame = PANDAS.read_parquet(table)
    ours = flown[1].port(COMMAND)
    assert frame[frame["port"] == COMMAND]["value"].tolist() == ours.values()
    assert frame[frame["port"] == COMMAND]["t_ns"].tolist() == ours.times_ns()
