"""`run` of a robot, of any DEVS model, and of a quantized system."""

import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import seconds
from firmware_runtime.models.pid import Pid
from firmware_runtime.models.qss import System, solve
from tests.support.command import VIRTUAL, Command
from tests.support.second_choice_board import second_choice_board
from tests.support.waiting import wait_until

PERCENTILES = {"p50", "p90", "p99", "p999", "max", "mean"}
BUS = {"transactions", "bytes", "errors", "retries", "utilisation"}
TRACED = {
    "world.yaw_rad",
    "world.yaw_rate_rad_s",
    "controller.yaw.command_n",
    "thrust_pairs.duties",
}


def lines_of(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


@pytest.mark.slow
def test_a_run_ends_settled_with_the_keys_others_rely_on(command: Command) -> None:
    document = command.document(*VIRTUAL)
    assert (document["board"], document["clock"]) == ("tachobot", "virtual")
    assert document["result"]["settled"] is True
    assert document["result"]["yaw_rad"] == pytest.approx(1.0, abs=0.02)
    assert document["result"]["yaw_error_rad"] == 1.0 - document["result"]["yaw_rad"]
    assert document["outputs_on"] == {"thrust_pairs": 0}
    statistics = document["statistics"]
    assert statistics["schema"] == 1
    assert statistics["scheduled"] == statistics["run"] + statistics["skipped"]
    assert statistics["models"]["imu"]["scheduled"] == 1001
    assert {"skipped", "coalesced", "overruns", "episodes", "worst"} <= set(statistics)
    assert statistics["deadline_misses"] == {"imu.sample -> thrust_pairs": 0}
    assert set(statistics["lateness_us"]) == set(statistics["step_us"]) == PERCENTILES
    assert {"imu", "thrust_pairs"} <= set(statistics["models"])
    assert set(statistics["models"]["imu"]["lateness_us"]) == PERCENTILES
    assert set(statistics["bus"]["i2c1"]) == BUS
    assert {"kernel", "python", "board_sha256", "settings", "run"} <= set(statistics["conditions"])


def test_its_document_says_where_the_run_is_recorded(command: Command) -> None:
    document = command.document(*VIRTUAL, "--for", 1)
    assert Path(document["recording"]).is_file()
    assert f"recorded in {document['recording']}" in command(*VIRTUAL, "--for", 1).out
    unrecorded = command.document(*VIRTUAL, "--for", 1, "--set", "recording.minutes=0")
    assert "recording" not in unrecorded


@pytest.mark.slow
def test_a_result_is_judged_by_the_reference_that_was_sent(command: Command) -> None:
    sent = ("--for", 20, "--input", "8:yaw_reference=0.5")
    result = command.document(*VIRTUAL, *sent)["result"]
    assert result["yaw_rad"] == pytest.approx(0.5, abs=0.02)
    assert (result["yaw_reference_rad"], result["settled"]) == (0.5, True)


@pytest.mark.slow
def test_the_statistics_have_the_serial_ports_of_a_robot_with_any(
    command: Command, tmp_path: Path
) -> None:
    board = second_choice_board(tmp_path)
    ended = command("run", board, "--doubles", "--clock", "virtual", "--for", 2, "--json")
    ports = json.loads(ended.out)["statistics"]["serial"]
    assert ports["treads"]["writes"] > 0
    assert ports["sonar"]["bytes_read"] > 0


@pytest.mark.slow
def test_text_is_a_small_chart_and_few_lines_with_the_outcome_first(command: Command) -> None:
    ended = command(*VIRTUAL)
    assert (ended.status, ended.error) == (0, "")
    _opening, chart, closing = ended.out.split("\n\n")
    assert ("world.yaw_rad" in chart, "█" in chart) == (True, True)
    did, outputs, punctual, recorded, further = closing.splitlines()
    assert re.fullmatch(r"TachoBot turned to 1\.\d\d rad and settled after \d\.\d s", did)
    assert outputs == "all outputs off"
    assert punctual == "in virtual time: no activation can be late"
    assert recorded.startswith("recorded in ")
    assert "replay tachobot" in further
    assert "stats" not in further, "it left no statistics"


def test_a_trace_has_the_plants_truth_at_every_tick(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    assert command(*VIRTUAL, "--for", 2, "--trace", path).status == 0
    by_port: dict[str, list[int]] = {}
    for line in lines_of(path):
        assert set(line) == {"t_ns", "port", "value"}
        by_port.setdefault(line["port"], []).append(line["t_ns"])
    ticks = by_port["imu.sample"]
    assert len(ticks) > 100
    assert all(by_port[port] == ticks for port in TRACED)


def test_the_same_seed_gives_identical_bytes(command: Command, tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("first", "second", "other")]
    for path, seed in zip(paths, (1, 1, 2), strict=True):
        command(*VIRTUAL, "--for", 2, "--trace", path, "--set", f"world.seed={seed}")
    first, second, other = (path.read_bytes() for path in paths)
    assert first == second
    assert first != other


@pytest.mark.slow
@pytest.mark.real_time
def test_a_real_time_run_on_time_gives_the_virtual_runs_trace(
    command: Command, tmp_path: Path
) -> None:
    """The tolerance is nearly a period; a machine that is later ends the run."""
    overruns = {"tolerance_us": 9000, "policy": "stop", "stop_after_us": 9000}
    overrides = [f"--set=overruns.imu.{name}={value}" for name, value in overruns.items()]
    virtual, real = tmp_path / "virtual", tmp_path / "real"
    command(*VIRTUAL, "--for", 1, *overrides, "--trace", virtual)

    def is_whole() -> bool:
        command("run", "tachobot", "--doubles", "--for", 1, *overrides, "--trace", real)
        assert virtual.read_bytes().startswith(real.read_bytes())
        return real.read_bytes() == virtual.read_bytes()

    wait_until(is_whole, "a second in which the machine is never late by 9 ms")


@pytest.mark.slow
def test_scaled_time_gives_the_same_result_sooner(command: Command) -> None:
    scaled = ("run", "tachobot", "--doubles", "--clock", "scaled", "--speed", 8, "--for", 4)
    document = command.document(*scaled)
    assert document["clock"] == "scaled"
    assert document["result"]["yaw_rad"] == pytest.approx(1.0, abs=0.05)


def test_an_exception_in_a_model_ends_with_outputs_off_and_statistics_kept(
    command: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    calls = iter(range(1000))

    def fail_after_a_second(pid: Pid, *_arguments: object) -> float:
        if next(calls) < 100:
            return 0.1
        raise ZeroDivisionError(f"{pid.name} went wrong")

    monkeypatch.setattr(Pid, "_answer", fail_after_a_second)
    path = tmp_path / "kept.stats"
    ended = command(*VIRTUAL, "--json", "--statistics", path)
    document = json.loads(ended.out)
    assert ended.status == 1
    assert "tachobot.controller.yaw at 1." in ended.error
    assert "yaw went wrong" in ended.error
    assert document["outputs_on"] == {"thrust_pairs": 0}
    assert document["ended"]["state"] == "failed"
    kept = json.loads(command("stats", "--statistics", path, "--json").out)
    assert kept == {**document["statistics"], "takeovers": []}
    assert kept["conditions"]["run"]["state"] == "failed"


HERE = __name__


class Ramp(Atomic):
    """Sends a value that grows, again and again, from what was last put in."""

    def __init__(self, name: str, period_s: float, *, step: float = 1.0) -> None:
        super().__init__(name)
        self.level = self.out_port("level", float)
        self.start = self.in_port("start", float)
        self._period = seconds(period_s)
        self._step = step
        self._at = 0.0

    def initialize(self) -> None:
        """Begin."""
        self.hold_in("rising", self._period)

    def output(self) -> None:
        """Send."""
        self.level.send(self._at)

    def internal(self) -> None:
        """Rise."""
        self._at += self._step
        self.hold_in("rising", self._period)

    def external(self, elapsed: int) -> None:
        """Go on from there."""
        self._at = self.start[-1]
        self.continue_(elapsed)


def two_ramps() -> Coupled:
    """Two of them, which send nothing outside."""
    model = Coupled("ramps")
    model.add(Ramp("slow", 1.0))
    model.add(Ramp("quick", 0.5))
    return model


ONE = Ramp("one", 2.0)


def sent(out: str) -> list[str]:
    return [line for line in out.splitlines() if line.startswith("00:00:")]


def test_a_class_is_made_with_arguments_and_runs_at_once(command: Command) -> None:
    words = ("--set", "period_s=0.5", "--set", "step=2", "--for", "1")
    ended = command("run", f"{HERE}:Ramp", *words)
    assert (ended.status, ended.error) == (0, "")
    assert sent(ended.out) == ["00:00:00:500 level 0", "00:00:01:000 level 2"]
    last = ended.out.splitlines()[-2:]
    assert last == [f"{HERE}:Ramp ran for 1.00 s", "in virtual time: no activation can be late"]


def test_a_function_or_a_model_will_do_and_ten_seconds_are_run(
    command: Command, tmp_path: Path
) -> None:
    trace = tmp_path / "trace.jsonl"
    assert command("run", f"{HERE}:two_ramps", "--trace", trace).status == 0
    ports = [json.loads(line)["port"] for line in trace.read_text().splitlines()]
    assert (ports.count("slow.level"), ports.count("quick.level")) == (10, 20)
    document = json.loads(command("run", f"{HERE}:ONE", "--json").out)
    assert document["clock"] == "virtual"
    assert len(document["result"]["outputs"]) == 5


def test_values_are_put_in_as_into_a_robot(command: Command, tmp_path: Path) -> None:
    words = ("--set", "period_s=1", "--for", "3", "--input", "1.5:start=10")
    outputs = tmp_path / "out.txt"
    assert command("run", f"{HERE}:Ramp", *words, "--outputs", outputs).status == 0
    assert sent(outputs.read_text())[1:] == ["00:00:02:000 level 10", "00:00:03:000 level 11"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("Ramp",), "period_s: not stated; expected --set period_s=VALUE"),
        (("Ramp", "--set", "perod_s=1"), "did you mean period_s?"),
        (("Ramp", "--set", "period_s"), "expected NAME=VALUE"),
        (("ONE", "--set", "period_s=1"), "it is a model already"),
        (("ONE", "--arm"), "leave --arm out"),
        (("ONE", "--plot", "x.svg"), "--plot: has no effect"),
        (("ONE", "--input", "1:stop=1"), "no such input port"),
        (("Ram",), "did you mean Ramp?"),
    ],
)
def test_what_cannot_be_run_is_a_sentence(
    command: Command, words: tuple[str, ...], sentence: str
) -> None:
    assert sentence in command.refused("run", f"{HERE}:{words[0]}", *words[1:])


FALL = System(
    states={"height": 10.0, "speed": 0.0}, equations={"height": "speed", "speed": "-9.81"}
)
NOTHING = 3


def make() -> System:
    """A system, when it is asked for."""
    return FALL


@pytest.mark.parametrize("name", ["FALL", "make"])
def test_the_table_has_what_solve_returns(command: Command, name: str) -> None:
    head, *rows = command.said(
        "run", f"{__name__}:{name}", "--for", "1", "--samples", "3"
    ).splitlines()
    times, values = solve(FALL, 1.0, samples=3)
    assert head == "t_s,height,speed"
    expected = zip(times, values["height"], values["speed"], strict=True)
    assert [tuple(map(float, row.split(","))) for row in rows] == list(expected)


def test_method_and_quantum_are_those_of_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["run", f"{__name__}:FALL", "--for", "1", "--samples", "2"]
    main([*words, "--set", "method=QSS1", "--set", "quantum=0.5"])
    rough = capsys.readouterr().out
    main(words)
    assert rough != capsys.readouterr().out


def test_files_are_a_table_or_a_plot(tmp_path: Path) -> None:
    files = ["--outputs", str(tmp_path / "fall.csv"), "--plot", str(tmp_path / "fall.svg")]
    assert main(["run", f"{__name__}:FALL", "--for", "1", *files]) == 0
    assert (tmp_path / "fall.csv").read_text().startswith("t_s,height,speed\n")
    assert ">height<" in (tmp_path / "fall.svg").read_text()


SYSTEM = f"{__name__}:FALL"


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (["no_such_module:X"], "ModuleNotFoundError"),
        ([f"{__name__}:NOTHING"], "not callable"),
        ([f"{__name__}:FALLS"], "has no FALLS; did you mean FALL?"),
        ([f"{__name__}:"], "it names no object; expected a board"),
        ([":FALL"], "it names no module; expected a board"),
        ([SYSTEM, "--for", "-1"], "expected a positive number"),
        ([SYSTEM, "--samples", "1"], "expected a whole number from 2"),
        ([SYSTEM, "--samples", "10000001"], "2 to 10000000 samples"),
        ([SYSTEM, "--set", "quantum=1e-300"], "quantum of height"),
        ([SYSTEM, "--set", "quantums=1"], "did you mean quantum?"),
        ([SYSTEM, "--plot", "fall.pdf"], "ends in .svg or .png or .html or .json"),
        ([SYSTEM, "--json"], "--json: has no effect"),
        ([SYSTEM, "--clock", "monotonic"], "--clock monotonic: has no effect"),
        ([SYSTEM, "--doubles"], "leave --doubles out"),
    ],
)
def test_bad_input_is_one_sentence(
    capsys: pytest.CaptureFixture[str], words: list[str], fault: str
) -> None:
    looked_for = [*sys.path]
    try:
        status = main(["run", *words])
    except SystemExit as exit_:
        status = int(exit_.code or 0)
    assert sys.path == looked_for
    assert (status, fault in capsys.readouterr().err) == (2, True)
