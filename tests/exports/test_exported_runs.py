"""Exported runs, read back by others: rosbags for MCAP, csv and pyarrow for tables."""

import csv
import io
import json
import sys
from collections import defaultdict
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from time import time_ns
from typing import Any, NamedTuple

import msgspec
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from firmware_runtime.cli.main import main
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.models.motion import Applied
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.recording.blackbox.section import Kind, Section, encode, sent_of
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.exports.mcap_file import _FIELDS, definition_of, marker_of
from firmware_runtime.recording.exports.run_file import (
    csv_of,
    long_table,
    parquet_of,
    wide_table,
)
from firmware_runtime.recording.exports.typed_values import (
    Sent,
    entered_in,
    passed,
    sections_between,
    typed,
)
from firmware_runtime.runs.session import Session
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.statistics.number_formats import utc
from tests.support.command import Command
from tests.support.recorded import every_section, record, rewrite

PARQUET: Any = import_module("pyarrow.parquet")
Read = dict[str, list[tuple[int, Any]]]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("run") / "x.recording", "tachobot", 1.0)


@pytest.fixture(scope="module")
def recording(run: Path) -> Recording:
    return read_recording(run)


def exported(run: Path, folder: Path, ending: str, *words: object) -> Path:
    path = folder / f"x{ending}"
    assert main(["export", str(run), "-o", str(path), *map(str, words)]) == 0
    return path


def test_what_was_sent_as_a_run_began_is_in_it_too(recording: Recording) -> None:
    assert next(passed(recording, board_of(recording.header))).at == 0


def began(run: Path) -> int:
    """The date of a run's start."""
    date = read_recording(run).dates().of(0)
    assert date is not None
    return date


def messages_in(path: Path, since: int) -> Read:
    """Instant of the run, begun at that date, and message of each topic, as rosbags has them."""
    found: Read = defaultdict(list)
    with AnyReader([path]) as reader:
        for connection, at, raw in reader.messages():
            found[connection.topic].append(
                (at - since, reader.deserialize(raw, connection.msgtype))
            )
    return found


def recorded(recording: Recording, port: str) -> list[tuple[int, Any]]:
    """Instant and value of all that left a port, as the recording has it."""
    number = recording.header.ports.index(port)
    return [
        (section.at, value)
        for section in sections_between(recording, 0, NEVER)
        for sent, value in sent_of(section)
        if sent == number
    ]


@pytest.mark.slow
def test_topics_of_ros_2_have_every_value_at_its_instant(
    run: Path, recording: Recording, tmp_path: Path
) -> None:
    read = messages_in(exported(run, tmp_path, ".mcap"), began(run))
    samples = recorded(recording, "imu.sample")
    messages = read["/tachobot/imu/data_raw"]
    assert len(messages) == len(samples) > 10
    for (at, message), (sent_at, sample) in zip(messages, samples, strict=True):
        acceleration, rate, *_ = sample
        assert at == sent_at
        stamp = message.header.stamp
        assert stamp.sec * SECOND + stamp.nanosec == at + began(run)
        assert message.header.frame_id == "imu_link"
        measured = message.linear_acceleration
        assert [measured.x, measured.y, measured.z] == list(acceleration)
        measured = message.angular_velocity
        assert [measured.x, measured.y, measured.z] == list(rate)
        assert message.orientation_covariance[0] == -1
    forces = [list(each.data) for _, each in read["/tachobot/controller/forces"]]
    assert len(forces) == len(messages)
    assert all(len(each) == 4 for each in forces)


def test_other_ports_lines_steps_and_markers_are_in_it(
    run: Path, recording: Recording, tmp_path: Path
) -> None:
    read = messages_in(exported(run, tmp_path, ".mcap"), began(run))
    commands = [(at, each.data) for at, each in read["/tachobot/ports/controller/yaw/command_n"]]
    assert commands == recorded(recording, "controller.yaw.command_n")
    applied = read["/tachobot/ports/thrust_pairs/applied/json"]
    names = [(at, Applied[json.loads(each.data)]) for at, each in applied]
    assert names == recorded(recording, "thrust_pairs.applied") != []
    sections = list(sections_between(recording, 0, NEVER))
    transfers = [each for section in sections for each in section.transfers]
    said = read["/tachobot/raw/i2c1"]
    assert [at for at, _ in said] == sorted(each.at for each in transfers)
    answers = sorted(each.answer for each in transfers if not each.failed)
    assert sorted(bytes(each.read) for _, each in said) == answers
    assert [each.what for _, each in read["/tachobot/markers"]][-1] == "ended"
    assert len(read["/tachobot/raw/clock"]) == sum(each.kind == 4 for each in sections)


def test_a_stretch_is_what_lies_between(run: Path, tmp_path: Path) -> None:
    read = messages_in(exported(run, tmp_path, ".mcap", "--from", 0.85, "--until", 0.9), began(run))
    messages = read["/tachobot/imu/data_raw"]
    ats = [at for at, _ in messages]
    assert (min(ats), max(ats), len(ats)) == (850_000_000, 900_000_000, 6)
    headers = [each.header for _, each in messages]
    stamps = [each.stamp.sec * SECOND + each.stamp.nanosec for each in headers]
    assert stamps == [began(run) + at for at in ats]
    assert {each.frame_id for each in headers} == {"imu_link"}


def test_dates_are_those_that_the_run_has_noted(recording: Recording, tmp_path: Path) -> None:
    path, began = tmp_path / "x.recording", 1_800_000_000 * SECOND
    path.write_bytes(recording.path.read_bytes())
    noted: list[tuple[int, object]] = [
        (SECOND, [7, began + SECOND]),
        *((2 * SECOND, each) for each in ([7, 8, 9], [7, None], 7)),
        (3 * SECOND, [7, began + 60 * SECOND]),  # the system's clock was set
    ]
    dates = [encode((Kind.DATE.value, at, *[[]] * 7, extra)) for at, extra in noted]
    rewrite(path, [*every_section(path), *dates])
    found = read_recording(path).dates()
    ats = (0, 2 * SECOND, 4 * SECOND)
    assert [found.of(at) for at in ats] == [began, began + 2 * SECOND, began + 61 * SECOND]


def test_definitions_are_those_of_ros_2() -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    for name in _FIELDS:
        package, _, kind = name.partition("/")
        if package == "firmware_runtime":
            continue
        fields = store.fielddefs[f"{package}/msg/{kind}"][1]
        lines = [line.split() for line in _FIELDS[name].splitlines() if "=" not in line]
        assert [line[1] for line in lines] == [field for field, _ in fields], name
    assert definition_of("sensor_msgs/msg/PointCloud2") is None


@pytest.mark.slow
def test_a_long_table_has_a_row_for_each_number(
    run: Path, recording: Recording, tmp_path: Path
) -> None:
    with exported(run, tmp_path, ".csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    commands = [
        (int(row["t_ns"]), float(row["value"]))
        for row in rows
        if (row["port"], row["field"]) == ("controller.yaw.command_n", "")
    ]
    assert commands == recorded(recording, "controller.yaw.command_n")
    fields = {row["field"] for row in rows if row["port"] == "imu.sample"}
    assert {"acceleration.0", "rate.2", "temperature_c"} <= fields
    table = PARQUET.read_table(exported(run, tmp_path, ".parquet")).to_pylist()
    assert [row["t_ns"] for row in table] == [int(row["t_ns"]) for row in rows]
    assert [row["port"] for row in table] == [row["port"] for row in rows]
    assert [f"{row['utc']:%H:%M:%S.%f}" for row in table] == [row["utc"][11:26] for row in rows]


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_a_port_alone_has_a_column_for_each_field(
    run: Path, recording: Recording, tmp_path: Path, ending: str
) -> None:
    path = exported(run, tmp_path, ending, "--port", "imu.sample")
    if ending == ".csv":
        with path.open(newline="") as file:
            rows: list[dict[str, Any]] = list(csv.DictReader(file))
    else:
        rows = PARQUET.read_table(path).to_pylist()
    samples = recorded(recording, "imu.sample")
    assert [int(row["t_ns"]) for row in rows] == [at for at, _ in samples]
    start = began(run)
    assert [str(row["utc"])[11:26] for row in rows] == [utc(start + at)[11:26] for at, _ in samples]
    assert [float(row["acceleration.2"]) for row in rows] == [each[0][2] for _, each in samples]


class Stamped(NamedTuple):
    t_ns: int
    utc: str
    port: int
    total: int


def test_fields_of_any_name_and_size_stand_beside_the_instants() -> None:
    rows = [Sent(at * SECOND, "gps.fix", Stamped(7, "noon", at, 1 << 64)) for at in (1, 2)]
    table = wide_table(rows)
    read = PARQUET.read_table(io.BytesIO(parquet_of(table))).to_pydict()
    assert read["t_ns"] == [1 * SECOND, 2 * SECOND]
    assert read["value.t_ns"] == [7, 7]
    assert read["port"] == [1, 2]
    assert read["total"] == ["18446744073709551616"] * 2
    header, first, _ = csv_of(table).decode().splitlines()
    assert header == "t_ns,t_s,utc,value.t_ns,value.utc,port,total"
    assert first == "1000000000,1.0,,7,noon,1,18446744073709551616"


@pytest.mark.parametrize("table_of", [long_table, wide_table])
def test_each_table_has_its_instants_in_nanoseconds_and_in_seconds(
    table_of: Callable[[list[Sent]], dict[str, Any]],
) -> None:
    table = table_of([Sent(SECOND // 2, "yaw_reference", -0.5)])
    assert (table["t_ns"], table["t_s"], table["value"]) == ([SECOND // 2], [0.5], [-0.5])


def test_several_ports_and_fields_are_chosen_by_name(run: Path, tmp_path: Path) -> None:
    words = ("--port", "imu.sample.rate", "--port", "controller.yaw.command_n")
    rows = list(csv.DictReader(exported(run, tmp_path, ".csv", *words).read_text().splitlines()))
    assert {(row["port"], row["field"]) for row in rows} == {
        ("controller.yaw.command_n", ""),
        *(("imu.sample", f"rate.{axis}") for axis in range(3)),
    }
    read = messages_in(exported(run, tmp_path, ".mcap", *words), began(run))
    assert set(read) == {
        "/tachobot/imu/data_raw",
        "/tachobot/imu/mag",
        "/tachobot/imu/temperature",
        "/tachobot/ports/controller/yaw/command_n",
        "/tachobot/markers",
    }
    alone = exported(run, tmp_path, ".csv", "--port", "imu.sample.rate").read_text()
    assert alone.splitlines()[0] == "t_ns,t_s,utc,rate.0,rate.1,rate.2"


def test_what_came_in_from_outside_is_in_it_by_its_port(tmp_path: Path) -> None:
    def turn_about(session: Session) -> None:
        port = session.robot.model.in_ports["yaw_reference"]
        session.executive.plan(SECOND // 2, port, -0.5)

    run = record(tmp_path / "turned.recording", "tachobot", 1.0, before=turn_about)
    table = exported(run, tmp_path, ".csv", "--port", "yaw_reference").read_text()
    date = utc(began(run) + SECOND // 2)
    assert table.splitlines() == ["t_ns,t_s,utc,value", f"500000000,0.5,{date},-0.5"]
    rows = list(csv.DictReader(exported(run, tmp_path, ".csv").read_text().splitlines()))
    (row,) = (each for each in rows if each["port"] == "yaw_reference")
    assert (row["t_ns"], row["value"]) == ("500000000", "-0.5")
    ((at, message),) = messages_in(exported(run, tmp_path, ".mcap"), began(run))[
        "/tachobot/ports/yaw_reference"
    ]
    assert (at, message.data) == (SECOND // 2, -0.5)


def test_a_coupled_model_s_port_has_what_is_sent_through_it(run: Path, tmp_path: Path) -> None:
    tables = [
        exported(run, tmp_path, ".csv", "--port", port).read_text()
        for port in ("controller.forces", "controller.allocation.forces")
    ]
    assert tables[0] == tables[1]
    assert tables[0].count("\n") > 20


@pytest.mark.parametrize(
    "case",
    [
        (["x", "-o", "x.csv"], "no file"),
        (
            ["tachobot", "-o", "x.pdf"],
            "expected a name that ends in .ma, .py, .mcap, .csv",
        ),
        (["detective", "--port", "x"], "--port: has no effect on a model"),
        (["RUN", "-o", "x.csv", "--port", "imu.sampel"], "did you mean"),
        (["RUN", "-o", "x.json", "--port", "imu.sample"], "--port: has no effect on .json"),
        (["RUN", "-o", "x.csv", "--set", "a=1"], "--set: has no effect on a run"),
        (["RUN", "-o", "nowhere/x.csv"], "expected a name in a folder that takes one"),
    ],
)
def test_bad_words_are_refused(
    run: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: Command,
    case: tuple[list[str], str],
) -> None:
    words, what = case
    monkeypatch.chdir(tmp_path)
    assert what in command.refused("export", *(run if each == "RUN" else each for each in words))
    assert list(tmp_path.iterdir()) == []


def test_without_the_extra_its_name_is_said(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    monkeypatch.setitem(sys.modules, "mcap_ros2.writer", None)
    said = command.refused("export", run, "-o", tmp_path / "x.mcap")
    assert "expected the extra mcap" in said


@pytest.mark.parametrize(
    ("kind", "extra", "marked"),
    [
        (Kind.ENDED, {"state": "failed", "reason": "a bug"}, ("ended", "failed: a bug")),
        (Kind.ENDED, None, ("ended", "")),  # of a file that something has changed
        (Kind.RETUNED, {"controller": {"kp": 1.0}}, ("settings", "")),
        (Kind.ARMED, False, ("disarmed", "")),
        (Kind.GO_ON, None, None),
    ],
)
def test_a_marker_says_how_a_run_ended(kind: Kind, extra: object, marked: object) -> None:
    section = Section(kind, SECOND, [], [], [], [], msgspec.Raw(b"\x90"), [], [], extra)
    assert marker_of(section) == marked


def test_what_came_in_over_a_link_has_the_name_that_it_crosses_by() -> None:
    part = Coupled("tachobot")
    part.in_port("imu:sample", float)
    entered: list[tuple[str, Any]] = [("imu:sample", 1)]
    section = Section(Kind.STEP, SECOND, [], [], [], [], msgspec.Raw(b"\x90"), [], entered)
    (sent,) = entered_in(section, part.in_ports)
    assert sent == (SECOND, "imu.sample", 1.0)


@pytest.mark.parametrize(
    ("form", "kind", "expected"),
    [
        (1, float, 1.0),
        ({"scalar": ["<f8", [], b"\0\0\0\0\0\0\xf0?"]}, float, 1.0),
        ({"list": [1, 2]}, list, [1, 2]),
        ("text", int, "text"),
        ([1, [2.5, None]], object, [1, [2.5, None]]),
    ],
)
def test_values_are_what_their_ports_types_say(
    form: object, kind: object, expected: object
) -> None:
    assert json.loads(json.dumps(plain(typed(form, kind)))) == expected


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--from", "1.5"), "--from 1.5: the run ends at 1 s"),
        (("--from", "0.5", "--until", "0.4"), "--until 0.4: expected an instant after --from 0.5"),
    ],
)
def test_a_stretch_that_the_run_has_not_is_refused(
    run: Path, tmp_path: Path, command: Command, words: tuple[str, ...], said: str
) -> None:
    for path in (tmp_path / "x.csv", tmp_path / "x.mcap", tmp_path / "x.parquet"):
        assert said in command.refused("export", run, "-o", path, *words)
        assert not path.exists()


def test_a_bag_of_a_run_that_began_now_begins_now(tmp_path: Path) -> None:
    before = time_ns()
    run = record(tmp_path / "now.recording", "tachobot", 1.0)
    (at, _), *_ = messages_in(exported(run, tmp_path, ".mcap"), 0)["/tachobot/imu/data_raw"]
    assert before < at < time_ns() + SECOND  # its first second was faster than time
