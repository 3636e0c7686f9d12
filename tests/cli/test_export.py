"""`export`: a run for perfetto, at once or when an activation is late; and models."""

import json
import re
import signal
import subprocess
from importlib.resources import files
from itertools import cycle
from pathlib import Path

import pytest
from firmware_boards.detective.detective import MODEL_FILE
from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import BeingWrittenError
from firmware_runtime.recording.exports import run_file
from firmware_runtime.statistics import late_watch
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from tests.support import figure_6
from tests.support.command import Command, own_process, started
from tests.support.recorded import record
from tests.support.trace_rules import assert_sound, slices
from tests.support.waiting import PATIENCE_S
from tests.support.written_run import WrittenRun


class RunUnderWay(WrittenRun):
    """The statistics of a run under way."""

    def step(self, lateness: int) -> None:
        """Ten milliseconds later, one more activation of `imu`."""
        at = self.elapsed // (10 * MILLISECOND) * (10 * MILLISECOND) + 10 * MILLISECOND
        self.activation(at, lateness, MILLISECOND)
        self.keep([1_000_000], t_ns=at, lateness_ns=lateness, step_ns=MILLISECOND)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return record(tmp_path_factory.mktemp("run") / "x.recording", "tachobot", 1.0).read_bytes()


@pytest.fixture
def run(state_directory: Path, recorded: bytes) -> RunUnderWay:
    state_directory.mkdir()
    (state_directory / "robot.recording").write_bytes(recorded)
    made = RunUnderWay(path=state_directory / "robot.stats")
    made.step(9 * MILLISECOND)
    return made


@pytest.fixture
def output(tmp_path: Path) -> Path:
    return tmp_path / "trace.json"


@pytest.mark.usefixtures("run")
@pytest.mark.parametrize("named", ["by board", "by statistics", "by recording", "not at all"])
def test_a_trace_is_taken_at_once(
    command: Command, output: Path, state_directory: Path, named: str
) -> None:
    words: dict[str, list[object]] = {
        "by board": ["robot"],
        "by statistics": [state_directory / "robot.stats"],
        "by recording": [state_directory / "robot.recording"],
        "not at all": [],
    }
    ended = command("export", *words[named], "-o", output)
    assert (ended.status, ended.error) == (0, "")
    assert ended.out.startswith(f"{output}: ")
    assert ended.out.endswith(", from 0.000 s to 1.000 s\n")
    trace = json.loads(output.read_text())
    assert_sound(trace)
    assert "conditions" in trace["otherData"]
    models = {name for depth, name, _, _ in slices(trace, "loop") if depth == 1}
    assert {"imu", "controller.yaw", "thrust_pairs"} <= models


@pytest.mark.usefixtures("run")
def test_only_the_last_seconds_are_taken(command: Command, output: Path) -> None:
    assert command("export", "-o", output, "--last", 0.03).status == 0
    steps = [each for each in slices(json.loads(output.read_text()), "loop") if each[0] == 0]
    assert {begin for _, _, begin, _ in steps} == {970_000, 980_000, 990_000, 1_000_000}


@pytest.mark.parametrize("is_of_it", [True, False])
def test_of_a_piece_that_was_kept_the_conditions_are_beside_it(  # noqa: PLR0917 -- fixtures
    command: Command,
    run: RunUnderWay,
    recorded: bytes,
    output: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    *,
    is_of_it: bool,
) -> None:
    piece = tmp_path / "robot-0007-late-2.recording"
    piece.write_bytes(recorded)
    assert command("stats", "robot", "--save", tmp_path / "robot-0007.stats").status == 0
    if not is_of_it:
        monkeypatch.setattr(run_file, "read_statistics", lambda _path: _of_process(run, 1))
    assert command("export", piece, "-o", output).status == 0
    assert ("conditions" in json.loads(output.read_text())["otherData"]) == is_of_it


def _of_process(run: RunUnderWay, pid: int) -> Statistics:
    statistics = run.statistics()
    writer = replace(statistics.header.writer, pid=pid)
    return replace(statistics, header=replace(statistics.header, writer=writer))


def test_a_late_activation_takes_the_trace_with_what_came_of_it(
    command: Command, run: RunUnderWay, output: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lateness = iter([0, 3 * MILLISECOND, MILLISECOND])
    monkeypatch.setattr(late_watch, "sleep", lambda _span: run.step(next(lateness)))
    ended = command("export", "-o", output, "--when-late", 2000)
    assert ended.status == 0
    assert ended.out.endswith("taken because of imu at 0.040 s, 3.00 ms late\n")
    trace = json.loads(output.read_text())
    assert_sound(trace)
    assert next(lateness, None) is None
    (mark,) = [each for each in trace["traceEvents"] if each["ph"] == "i"]
    assert mark["ts"] == 43_000


def test_a_run_that_is_stopped_half_way_through_its_counting_is_read_when_it_goes_on(
    command: Command, run: RunUnderWay, output: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_stopped = cycle([True, False])

    def read(kept: Path) -> Statistics:
        if next(is_stopped):
            raise BeingWrittenError("it keeps the file half written")
        return read_statistics(kept)

    monkeypatch.setattr(late_watch, "read_statistics", read)
    monkeypatch.setattr(late_watch, "sleep", lambda _span: run.step(3 * MILLISECOND))
    ended = command("export", "-o", output, "--when-late", 2000)
    assert (ended.status, ended.error) == (0, "")


def test_waiting_has_an_end(
    command: Command, run: RunUnderWay, output: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    instants = iter([0.0, 0.1, 0.2, 5.1])
    monkeypatch.setattr(late_watch, "monotonic", lambda: next(instants))
    monkeypatch.setattr(late_watch, "sleep", lambda _span: run.step(MILLISECOND))
    ended = command("export", "-o", output, "--when-late", 2000, "--wait", 5)
    assert (ended.status, ended.out) == (6, "")
    assert "no activation was over 2000 us late within 5 s" in ended.error
    assert not output.exists()


def test_waiting_ends_with_the_run(
    command: Command, run: RunUnderWay, output: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(late_watch, "sleep", lambda _span: run.statistics(RunState.ENDED))
    ended = command("export", "-o", output, "--when-late", 2000)
    assert ended.status == 6
    assert "the run is not under way" in ended.error


def test_ctrl_c_ends_the_waiting_cleanly(
    command: Command, run: RunUnderWay, output: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(_span: float) -> None:
        run.step(0)
        raise KeyboardInterrupt

    monkeypatch.setattr(late_watch, "sleep", interrupt)
    ended = command("export", "-o", output, "--when-late", 2000)
    assert ended.status == 130
    assert ended.error == "firmware-runtime: interrupted; no trace was written\n"
    assert not output.exists()


@pytest.mark.usefixtures("run")
@pytest.mark.parametrize("waiting", [[], ["--when-late", 2000]])
def test_a_run_without_a_recording_is_answered_with_how_to_have_one(
    command: Command, output: Path, state_directory: Path, waiting: list[object]
) -> None:
    (state_directory / "robot.recording").unlink()
    assert "expected one with recording.minutes over 0 in its board.toml" in command.refused(
        "export", "-o", output, *waiting
    )


def test_a_file_that_cannot_be_written_is_said(
    command: Command, run: RunUnderWay, tmp_path: Path
) -> None:
    assert run.elapsed > 0
    assert "trace.json: no file that can be written" in command.refused(
        "export", "-o", tmp_path / "absent" / "trace.json"
    )


LIMIT_US = 100_000


@pytest.mark.slow
@pytest.mark.real_time
def test_a_stall_takes_a_trace_that_shows_it(tmp_path: Path) -> None:
    output = tmp_path / "trace.json"
    run = started("run", "tachobot", "--doubles", "--for", "600", stderr=subprocess.DEVNULL)
    try:
        wait_for_steps(run)
        watch = started(
            "export",
            "tachobot",
            "-o",
            str(output),
            "--when-late",
            str(LIMIT_US),
            stderr=subprocess.PIPE,
        )
        stall_until_it_ends(run, watch)
        said, complaint = watch.communicate(timeout=PATIENCE_S)
    finally:
        run.kill()
        run.communicate(timeout=PATIENCE_S)
    assert (watch.returncode, complaint) == (0, "")
    assert re.search("taken because of (imu|thrust_pairs) at ", said)
    trace = json.loads(output.read_text())
    assert_sound(trace)
    (mark,) = [each for each in trace["traceEvents"] if each.get("s") == "g"]
    late = [(begin, end) for _, _, begin, end in slices(trace, "waking") if end - begin > LIMIT_US]
    assert any(begin < mark["ts"] <= end + 1000 for begin, end in late)
    assert {depth for depth, *_ in slices(trace, "loop")} == {0, 1}


def wait_for_steps(run: "subprocess.Popen[str]") -> None:
    """Return once the run is seen to count; each look starts a process, so nothing spins."""
    for _look in range(200):
        if run.poll() is not None:
            break
        seen = looked()
        if seen.returncode == 0 and json.loads(seen.stdout)["run"] > 0:
            return
    pytest.fail(f"the run did not get going: {run.poll()}")


def stall_until_it_ends(run: "subprocess.Popen[str]", watch: "subprocess.Popen[str]") -> None:
    """Stop the run for as long as another process takes, until the watch has seen it."""
    for _stall in range(200):
        if watch.poll() is not None:
            return
        run.send_signal(signal.SIGSTOP)
        looked()
        run.send_signal(signal.SIGCONT)
        looked()


def looked() -> "subprocess.CompletedProcess[str]":
    return own_process("stats", "tachobot", "--json")


TOP = Path(str(files("generator_buffer_processor"))) / "top.ma"


@pytest.mark.slow
def test_a_board_exported_and_imported_again_plays_figure_6(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("figure6.ev").write_text(figure_6.EVENTS)
    assert command("export", "detective", "-o", "robot.ma").out == "robot.ma\n"
    assert command("export", "robot.ma", "-o", "figure_6_robot.py").out == "figure_6_robot.py\n"
    for model in ("robot.ma", "figure_6_robot:Top"):
        ended = command("run", model, "--events", "figure6.ev")
        assert (ended.status, ended.out, ended.error) == (0, figure_6.OUTPUTS, "")
    assert command("export", "figure_6_robot:Top").out == Path("robot.ma").read_text()


def test_a_folder_becomes_a_package(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert command("export", TOP, "-o", "imported_gbp").status == 0
    ended = command("run", "imported_gbp:Top", "--events", TOP.with_name("jobs.ev"))
    assert ended.out == TOP.with_name("jobs.out").read_text()


def test_a_model_file_is_drawn(command: Command, tmp_path: Path) -> None:
    assert command("show", TOP, "-o", tmp_path / "top.svg").status == 0
    assert "BUF-PROC" in (tmp_path / "top.svg").read_text()


def test_a_model_file_has_a_tree(command: Command) -> None:
    assert "PROC" in command("show", TOP).out


def test_what_is_there_is_not_written_over(command: Command, tmp_path: Path) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text("mine")
    (tmp_path / "package").mkdir()
    (tmp_path / "package/__init__.py").write_text("mine")
    for output in (mine, tmp_path / "package"):
        assert "exists; expected a new file" in command.refused("export", MODEL_FILE, "-o", output)
    assert mine.read_text() == "mine"


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("#include(rules.inc)", "line 1: #include is not supported"),
        ("#macro(x)", "line 1: #macro is not supported"),
        ("[top]\ncomponents : c\n[c]\ntype : cell", "line 4: [c] is a grid of cells"),
    ],
)
def test_what_cd_plus_plus_has_and_this_has_not_is_refused_with_file_and_line(
    command: Command, tmp_path: Path, line: str, sentence: str
) -> None:
    path = tmp_path / "grid.ma"
    path.write_text(line)
    error = command.refused("export", path)
    assert str(path) in error
    assert sentence in error
