"""Completion in real shells; a run in a terminal, the line of its progress, and its chart."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from io import StringIO
from pathlib import Path
from select import select
from types import SimpleNamespace
from typing import Any

import pytest

from firmware_runtime.cli.run_report import MOST, Series
from firmware_runtime.cli.terminal_chart import chart
from firmware_runtime.cli.verbs import VERBS, verb_names
from firmware_runtime.devs.time import MICROSECOND, NEVER, SECOND
from firmware_runtime.runs.progress_line import EVERY, RESERVE, ProgressLine
from firmware_runtime.system.terminal import OwnTerminal, is_same_place
from tests.support.completion import ways_on
from tests.support.terminal import at_a_terminal, terminal_of
from tests.support.waiting import PATIENCE_S

PROGRAM = Path(sys.executable).with_name("firmware-runtime")
SHELLS = ("bash", "zsh", "fish")
INSTALLED = [shell for shell in SHELLS if shutil.which(shell)]
"""Bash at least; on a machine that has zsh and fish, these too."""


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("ru",), ["run"]),
        (("run", "tacho"), ["tachobot"]),
        (("run", "tachobot", "--cl"), ["--clock"]),
        (("run", "tachobot", "--clock", "v"), ["virtual"]),
        (("run", "tachobot", "--for", ""), []),
        (("run", "tachobot", "--clock", "virtual", "--doub"), ["--doubles"]),
        (("run", "--doubles", "det"), ["detective"]),
        (("export", "det"), ["detective"]),
        (("export", "x.ma", "--out"), ["--output"]),
        (("check", "tachobot", "--set", "controller.yaw.kp"), ["controller.yaw.kp="]),
        (("check", "nobot", "--set", "controller"), []),
        (("service", "st"), ["status"]),
        (("service", "logs", "det"), ["detective"]),
        (("service", "logs", "--fol"), ["--follow"]),
        (("doubles", "serve", "--chip", "pca"), ["pca9685"]),
        (("doubles", "re"), ["replay"]),
        (("doubles", "replay", "tacho"), ["tachobot"]),
        (("doubles", "replay", "tachobot", "--war"), ["--warn"]),
        (("try", "ads"), ["ads1115"]),
        (("new", "ch"), ["chip"]),
        (("bench", "dev"), ["devstone"]),
        (("experiment", "embedded"), ["embedded-step-friction"]),
        (("experiment", "al"), ["all"]),
        (("sweep", "sh"), ["show"]),
        (("sweep", "tachobot", "--vary", "world.ma"), ["world.mass_kg="]),
        (("experiment", "all", "tacho"), ["tachobot"]),
        (("gate", "main", ".", "tacho"), ["tachobot"]),
        (("gate", "main", ".", "--tol"), ["--tolerance"]),
        (("recordings", "re"), ["recover"]),
        (("--ver",), ["--version"]),
        (("nonsense", ""), []),
    ],
    ids=" ".join,
)
def test_what_may_come_next(words: tuple[str, ...], expected: list[str]) -> None:
    assert ways_on(*words) == expected


def test_every_verb_is_offered_and_has_its_options() -> None:
    assert ways_on("") == verb_names()
    for verb in VERBS:
        assert "--help" in ways_on(verb, "--")


ASK_BASH = """
source <("$(dirname "$1")/register-python-argcomplete" firmware-runtime)
complete -p firmware-runtime
COMP_LINE=$2 COMP_POINT=${#2} COMP_TYPE=9
_python_argcomplete "$1"
printf '%s\\n' "${COMPREPLY[@]}"
"""
ASK_ZSH = """
autoload -Uz compinit; compinit -u -D
source <("$(dirname "$1")/register-python-argcomplete" --shell zsh firmware-runtime)
print -r -- ${_comps[firmware-runtime]}
BUFFER=$2; CURSOR=${#2}; words=("$1")
_describe() { print -rl -- "${completions[@]}"; }
_python_argcomplete
"""
ASK_FISH = """
set -x PATH (dirname $argv[1]) $PATH
(dirname $argv[1])/register-python-argcomplete --shell fish firmware-runtime | source
complete -C "$argv[2]"
"""
ASKED = {"bash": ASK_BASH, "zsh": ASK_ZSH, "fish": ASK_FISH}


def asked(shell: str, *words: str) -> list[str]:
    """What a real shell offers at Tab."""
    options = ["--norc", "-c"] if shell == "bash" else ["-f", "-c"] if shell == "zsh" else ["-c"]
    line = " ".join(["firmware-runtime", *words])
    script = [ASKED[shell], *(() if shell == "fish" else ("ask",)), str(PROGRAM), line]
    done = subprocess.run(
        [shell, *options, *script], capture_output=True, text=True, check=False, timeout=PATIENCE_S
    )
    assert done.returncode == 0, done.stderr
    return [re.split("[\t:]", line)[0].rstrip() for line in done.stdout.splitlines()]


@pytest.mark.slow
@pytest.mark.parametrize("shell", INSTALLED)
@pytest.mark.parametrize(
    ("words", "expected"),
    [(("run", "tachobot", "--clock", "v"), "virtual"), (("run", "tach"), "tachobot")],
)
def test_a_real_shell_completes(shell: str, words: tuple[str, ...], expected: str) -> None:
    assert expected in asked(shell, *words)


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_a_shell_that_does_not_offer_files_by_itself_is_told_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shell: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kept.trace").touch()
    (tmp_path / "keeping").mkdir()
    offered = {each.partition(":")[0] for each in ways_on("stats", "--save", "k", shell=shell)}
    assert offered == {"kept.trace", "keeping/"}


@pytest.mark.slow
def test_bash_offers_files_where_nothing_is_known() -> None:
    registered, *offered = asked("bash", "run", "tachobot", "--trace", "")
    assert "-o default" in registered
    assert offered == [""]


def test_recordings_that_were_kept_are_known_by_their_names(
    tmp_path: Path, state_directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = tmp_path / "kept"
    monkeypatch.setenv("FIRMWARE_RUNTIME_KEPT_DIRECTORY", str(kept))
    for path in (state_directory / "yawbot.recording", kept / "yawbot" / "yawbot-0007.recording"):
        path.parent.mkdir(parents=True)
        path.touch()
    both = ["yawbot", "yawbot-0007"]
    for verb in (("replay",), ("debug",), ("recordings", "keep")):
        assert ways_on(*verb, "yaw") == both
    assert ways_on("export", "yaw") == both
    assert ways_on("doubles", "replay", "yaw") == both
    assert ways_on("run", "yaw") == []


RUN = ("-m", "firmware_runtime.cli", "run", "tachobot", "--doubles", "--clock", "scaled")
PACE = ("--speed", "4", "--for", "6")


class Rig:
    """A line of progress, a run that stands still, and a real time set by hand."""

    def __init__(self, until: int = NEVER) -> None:
        self.now = 0
        self.lines: list[str] = []
        self.run = SimpleNamespace(
            hooks=[],
            accounts=[SimpleNamespace(overruns=1), SimpleNamespace(overruns=2)],
            faults=SimpleNamespace(counted=[SimpleNamespace(count=1)]),
            simulator=SimpleNamespace(now=0, listen=self.listen),
        )
        run: Any = self.run
        terminal: Any = SimpleNamespace(show=self.lines.append)
        shown: Any = SimpleNamespace(name="yaw_rad")
        self.line = ProgressLine(run, terminal, until, shown, lambda: self.now)

    def listen(self, _port: object, receive: Callable[[int, float], None]) -> None:
        self.receive = receive

    def between_steps(self, at: int, left: int = SECOND) -> None:
        self.now = at
        self.line.between_steps(at, left)


def test_it_shows_time_value_overruns_and_faults() -> None:
    rig = Rig(until=20 * SECOND)
    rig.receive(0, 0.98765)
    rig.between_steps(3 * SECOND)
    assert rig.lines == ["3.0 of 20 s  yaw_rad 0.9877  3 overruns  1 fault"]
    assert rig.run.hooks == [rig.line]


def test_it_writes_a_few_times_a_second() -> None:
    rig = Rig()
    for at in range(0, SECOND + 1, SECOND // 100):
        rig.between_steps(at)
    assert len(rig.lines) == SECOND // EVERY


def test_without_time_to_the_next_event_nothing_is_written_and_nothing_is_lost() -> None:
    rig = Rig()
    rig.between_steps(EVERY, left=RESERVE)
    assert rig.lines == []
    rig.between_steps(EVERY + 1)
    assert len(rig.lines) == 1


def test_after_a_write_that_took_long_there_must_be_twice_that_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig()
    took = 10 * RESERVE

    def show(line: str) -> None:
        rig.lines.append(line)
        rig.now += took

    monkeypatch.setattr(rig.line._terminal, "show", show)
    rig.between_steps(EVERY)
    rig.between_steps(3 * EVERY, left=2 * took + RESERVE)
    assert len(rig.lines) == 1
    rig.between_steps(3 * EVERY, left=2 * took + RESERVE + 1)
    assert len(rig.lines) == 2


@pytest.mark.slow
def test_a_run_in_a_terminal_shows_it_and_takes_it_away_at_the_end() -> None:
    shown = at_a_terminal(sys.executable, *RUN, *PACE)
    lines = re.findall(r"\r([^\r\n]*overruns?  \d+ faults?)", shown)
    assert lines
    assert all(" of 6 s" in line for line in lines)
    assert re.search(r"\r +\r\r?\n", shown), "the last line is not taken away"
    assert "all outputs off" in shown


@pytest.mark.slow
def test_with_json_there_is_none() -> None:
    assert "\r{" not in (shown := at_a_terminal(sys.executable, *RUN, *PACE, "--json"))
    assert shown.startswith('{"board"')


def test_a_pipe_is_no_terminal() -> None:
    reading, writing = os.pipe()
    with os.fdopen(reading), os.fdopen(writing, "w") as stream:
        assert OwnTerminal.of(stream) is None
    assert OwnTerminal.of(None) is None


def test_two_streams_are_at_the_same_place_if_a_reader_of_one_sees_the_other() -> None:
    reading, writing = os.pipe()
    other, elsewhere = os.pipe()
    with ExitStack() as stack:
        for end in (reading, other):
            stack.callback(os.close, end)
        first, second, third = (
            stack.enter_context(os.fdopen(end, "w"))
            for end in (writing, os.dup(writing), elsewhere)
        )
        assert is_same_place(first, second)
        assert not is_same_place(first, third)
        assert not is_same_place(first, StringIO())
        assert not is_same_place(None, first)


@pytest.mark.slow
def test_what_went_wrong_is_said_once_at_a_terminal() -> None:
    shown = at_a_terminal(sys.executable, *RUN, "--speed", "4", "--for", "0.05", status=1)
    assert shown.count("imu was never ready") == 1


FLOOD = """
import os, sys
from firmware_runtime.system.terminal import OwnTerminal
terminal = OwnTerminal.of(sys.stdout)
for _ in range(2000):
    terminal.show("x" * 70)
os.write(int(sys.argv[1]), b"done")
os._exit(0)
"""


@pytest.mark.slow
def test_a_terminal_that_takes_nothing_keeps_nothing_waiting() -> None:
    reading, writing = os.pipe()
    with terminal_of(sys.executable, "-c", FLOOD, str(writing), keep=writing):
        os.close(writing)
        assert select([reading], (), (), PATIENCE_S)[0], "it waits for the terminal"
        assert os.read(reading, 4) == b"done"
    os.close(reading)


@pytest.mark.parametrize(
    ("until", "shown"),
    [(10 * SECOND, "10 s"), (10 * SECOND + 1500 * MICROSECOND, "10 s"), (SECOND // 2, "0.5 s")],
)
def test_the_end_of_the_time_axis_is_in_hundredths_of_a_second(until: int, shown: str) -> None:
    assert chart([(0, 0.0), (until, 1.0)], "label", until)[-1].endswith(f"label, 0 to {shown}")


def test_a_small_scale_is_not_zero_at_both_ends() -> None:
    lines = chart([(0, -2e-5), (SECOND, 1e-5)], "label", SECOND)
    assert [line.split()[0] for line in (lines[0], lines[-2])] == ["1e-05", "-2e-05"]
    assert len({line.index("┤") for line in lines[:-1]}) == 1


def test_values_below_zero_have_zero_on_their_scale_as_those_above_it() -> None:
    lines = chart([(0, -0.2), (SECOND, -0.2 - 1e-9)], "label", SECOND)
    assert [line.split()[0] for line in (lines[0], lines[-2])] == ["0.000", "-0.200"]


def test_where_nothing_came_the_last_value_is_held() -> None:
    seldom = [(at * SECOND, 1.0) for at in range(3, 10, 3)]
    *rows, _axis = chart(seldom, "label", 10 * SECOND)
    bars = [line.partition("┤")[2] for line in rows]
    assert len({*bars}) == 1
    assert re.fullmatch(" +█+", bars[0]), "nothing before the first, no gap after it"
    assert len(bars[0]) == len(chart([(0, 1.0)], "label", SECOND)[0].partition("┤")[2])


def test_a_series_without_a_value_is_not_drawn_and_a_flat_one_has_one_mark() -> None:
    assert chart([], "label", SECOND) == []
    marks = [line.split("┤")[0].strip() for line in chart([(0, 0.0)], "label", SECOND)[:-1]]
    assert marks == ["", "", "0.000"]


def test_a_short_series_is_kept_sample_by_sample() -> None:
    series = Series()
    for at in range(MOST - 1):
        series.add(at, at / 2)
    assert series.points == [(at, at / 2) for at in range(MOST - 1)]


@pytest.mark.parametrize("samples", [MOST, 2 * MOST, 10 * MOST + 7])
def test_a_long_one_is_bounded_and_keeps_its_mean(samples: int) -> None:
    series = Series()
    for at in range(samples):
        series.add(at, float(at))
    assert MOST // 2 <= len(series.points) < MOST
    width = series.points[1][0]
    assert all(value == at + (width - 1) / 2 for at, value in series.points)
    assert samples - width < series.points[-1][0] + width <= samples
