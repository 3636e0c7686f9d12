"""`firmware-runtime gate`: its three answers, its statuses, and what it refuses."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Generator
from contextlib import closing
from math import log
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from firmware_runtime.cli.commands import gate
from firmware_runtime.cli.main import main
from firmware_runtime.lab.gate.checkouts import Checkout
from firmware_runtime.lab.gate.contestant import Contestant
from firmware_runtime.lab.gate.decision import Verdict
from firmware_runtime.lab.gate.gate import pass_gate
from firmware_runtime.lab.gate.pairs import Pair, Stretch, last_error, measured_pairs
from tests.support.waiting import PATIENCE_S, wait_until

Version = Callable[[str, int], Path]
Captured = pytest.CaptureFixture[str]


def synthetic(*ratios: float) -> Generator[Pair, None, None]:
    """Pairs whose ratio goes to and fro between these."""
    while True:
        for ratio in ratios:
            head = Stretch(1.0, round(1_000_000 * ratio), activations=2, used=1)
            yield Pair(Stretch(1.0, 1_000_000, activations=1, used=1), head)


def answered(monkeypatch: pytest.MonkeyPatch, *ratios: float) -> None:
    monkeypatch.setattr(gate, "measured_pairs", lambda *_: synthetic(*ratios))


@pytest.mark.parametrize(
    ("ratios", "status", "verdict"),
    [
        ((1.0, 1.01, 0.99), 0, "no slower: HEAD takes no more than 10.0% more processor time"),
        ((0.8, 0.81, 0.79), 0, "no slower: HEAD takes no more than 10.0% more processor time"),
        ((1.2, 1.21, 1.19), 1, "slower: HEAD takes more than 10.0% more processor time"),
        ((1.05, 1.15, 1.4, 0.8), 11, "cannot tell here: the ratio may be anything from"),
    ],
)
def test_three_answers(  # noqa: PLR0917 -- fixtures
    ratios: tuple[float, ...],
    status: int,
    verdict: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: Captured,
) -> None:
    answered(monkeypatch, *ratios)
    assert main(["gate", str(tmp_path), str(tmp_path), "any"]) == status
    first, *rest = capsys.readouterr().out.splitlines()
    assert first.startswith(verdict)
    assert [line.split()[0] for line in rest[:3]] == ["BASE", "HEAD", "HEAD"]
    assert "signed ranks: slower p = " in rest[3]
    pairs = int(rest[3].split()[0])
    note = f"in the same robot time BASE had {pairs} activations, HEAD {2 * pairs}"
    assert rest[4] == f"  note: {note}"


def test_what_is_not_no_slower_is_red_on_request(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    for ratios, is_red in (((1.0, 1.01), False), ((1.05, 1.15, 1.4, 0.8), True)):
        answered(monkeypatch, *ratios)
        main(["gate", str(tmp_path), str(tmp_path), "any"])
        assert capsys.readouterr().out.startswith("\x1b[1;31m") is is_red


def test_the_json_has_the_documented_keys(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    answered(monkeypatch, 1.2, 1.21)
    words = ["any", "--json", "--pairs", "40", "--tolerance", "5"]
    assert main(["gate", str(tmp_path), str(tmp_path), *words]) == 1
    found = json.loads(capsys.readouterr().out)
    page = (Path(__file__).parents[2] / "docs" / "performance.md").read_text()
    assert [key for key in found if f"`{key}`" not in page] == []
    assert (found["verdict"], found["pairs"], found["most_pairs"]) == ("slower", 10, 40)
    assert found["tolerance"] == 0.05
    assert found["ratio_low"] <= found["ratio"] <= found["ratio_high"]
    assert found["base"] == {"stated": str(tmp_path), "commit": None}


def test_a_decision_that_is_never_clear_takes_all_looks() -> None:
    found = pass_gate(synthetic(1.0, 5.0, 0.2), "a run", 0.1, 9)
    assert (found.decision.verdict, found.decision.looks) == (Verdict.CANNOT_TELL, 3)


def first_pair(base: Path, head: Path, word: str) -> Pair:
    versions = Checkout("BASE", "base", base), Checkout("HEAD", "head", head)
    with closing(measured_pairs(versions, [word], 0)) as pairs:
        return next(pairs)


@pytest.mark.slow
def test_a_step_of_many_times_the_work_costs_many_times_as_much(version: Version) -> None:
    pair = first_pair(version("little", 10), version("much", 2_000), "gated:Worker")
    assert pair.log_ratio > log(1.5)
    assert pair.head.span_s == pair.base.span_s
    assert pair.head.activations == pair.base.activations


@pytest.mark.slow
def test_activations_are_those_of_each_version(version: Version) -> None:
    base, head = version("base", 100), version("head", 100)
    file = head / "gated.py"
    file.write_text(file.read_text().replace("MILLISECOND)", "MILLISECOND // 2)"))
    pair = first_pair(base, head, "gated:Worker")
    assert pair.head.activations == pytest.approx(2 * pair.base.activations, abs=2)


class Ending:
    """A run that is over after 0.3 s, with 30 activations."""

    def __init__(self) -> None:
        self.at_s = 0.0

    def run(self, span_s: float) -> SimpleNamespace:
        self.at_s = min(self.at_s + span_s, 0.3)
        return SimpleNamespace(at_s=self.at_s, statistics=SimpleNamespace(run=100 * self.at_s))

    def close(self) -> None:
        """Nothing is held."""


def test_a_run_that_is_over_is_begun_again(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Ending] = []

    def open_(_contestant: Contestant) -> Ending:
        opened.append(Ending())
        return opened[-1]

    monkeypatch.setattr(Contestant, "_open", open_)
    contestant = Contestant("any", [])
    assert contestant.stretch(0.2)["activations"] == pytest.approx(20)
    assert contestant.stretch(0.8)["activations"] == pytest.approx(80)
    assert len(opened) == 4
    assert opened[-1].at_s == pytest.approx(0.1)


@pytest.mark.slow
def test_a_command_is_measured_in_both_folders(tmp_path: Path, capsys: Captured) -> None:
    for name, turns in (("base", 10), ("head", 1_000_000)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "work.py").write_text(f"for _ in range({turns}): pass\n")
    folders = [str(tmp_path / "base"), str(tmp_path / "head")]
    command = ["--", sys.executable, "-S", "work.py"]
    assert main(["gate", *folders, "--pairs", "9", *command]) == 1
    assert "for a run of the command" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["nonsense", ".", "any"], "BASE nonsense: neither a folder nor a revision"),
        ([".", "."], "no board, no command"),
        ([".", ".", "--"], "no board, no command"),
        ([".", ".", "any", "--", "true"], "both a board and a command"),
        ([".", ".", "--set", "a=1", "--", "true"], "--set changes a board"),
        ([".", ".", "--", "./none"], "No such file or directory: './none'"),
        ([".", ".", "--", "false"], "it ended with 1; expected a command that ends with 0"),
    ],
)
def test_what_cannot_be_measured_is_one_sentence(
    words: list[str],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: Captured,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["gate", *words]) == 2
    said = capsys.readouterr().err
    assert sentence in said
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize("pairs", ["8", "481", "many"])
def test_a_number_of_pairs_that_cannot_decide_is_refused(pairs: str, capsys: Captured) -> None:
    with pytest.raises(SystemExit) as refused:
        main(["gate", ".", ".", "any", "--pairs", pairs])
    assert refused.value.code == 2
    assert "expected a whole number from 9" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "sentence"),
    [
        ("gated:Idle", "nothing happens in it by itself"),
        ("gated:Broken", "no such thing"),
        ("tachobot", "tachobot uses no module of it"),
    ],
)
def test_a_model_that_cannot_be_measured_is_a_sentence(
    model: str, sentence: str, version: Version, capsys: Captured
) -> None:
    folder = str(version("one", 1))
    assert main(["gate", folder, folder, model]) == 2
    assert sentence in capsys.readouterr().err


def is_dead(process: str) -> bool:
    """Whether it has gone, or waits for whatever reaps orphans."""
    try:
        return Path("/proc", process, "stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except FileNotFoundError:
        return True


def test_an_error_is_a_line_with_all_that_belongs_to_it() -> None:
    said = "Traceback:\n  File x\nfirmware_runtime.errors.ConfigError: a: 2 faults\n  - b\n  - c\n"
    assert last_error(said) == "a: 2 faults - b - c"
    assert last_error("") == ""


@pytest.mark.slow
def test_help_behind_the_folders_is_help(capsys: Captured) -> None:
    assert main(["gate", ".", ".", "--help"]) == 0
    assert "cannot tell here" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_it_with_nothing_left_behind(
    number: int, status: int, version: Version, tmp_path: Path
) -> None:
    folder = version("one", 1)
    (tmp_path / "places").mkdir()
    said = tmp_path / "said"
    environment = {**os.environ, "TMPDIR": str(tmp_path / "places")}
    command = f"echo $$ >> {said}; exec sleep 600"
    words = ["gate", str(folder), str(folder), "--", "sh", "-c", command]
    running: subprocess.Popen[Any] = subprocess.Popen(
        [sys.executable, "-m", "firmware_runtime.cli", *words], env=environment
    )
    try:
        while not (said.exists() and said.read_text().strip()):
            assert running.poll() is None
        running.send_signal(number)
        assert running.wait(PATIENCE_S) == status
    finally:
        running.kill()
        running.wait()
    assert list((tmp_path / "places").iterdir()) == []
    wait_until(lambda: is_dead(said.read_text().strip()), "the command is dead")
