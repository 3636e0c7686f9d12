"""`sweep`, `sweep show` and `sweep rerun`: what they print, write and refuse."""

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Command = Callable[..., Any]
VARY = ("--vary", "world.coulomb_friction_nm=linspace(0, 0.02, 3)", "--set")
WORDS = ("sweep", "tachobot", *VARY, "world.static_friction_nm=0.01", "--for", "1.5")


@pytest.mark.slow
def test_a_table_is_shown_and_each_row_can_be_run_again(command: Command, tmp_path: Path) -> None:
    table, page = tmp_path / "table.csv", tmp_path / "page.html"
    ended = command(*WORDS, "--workers", "1", "-o", table)
    assert (ended.status, ended.out) == (0, f"{table}: 3 runs: 2 ended, 1 refused\n")
    assert ended.error.splitlines()[-1].startswith("3 of 3 runs, 1 failed")

    shown = command("sweep", "show", table)
    assert "3 runs: 2 ended, 1 refused" in shown.out
    assert "did not end in order:\n  row 2: refused, world.static_friction_nm" in shown.out

    found = json.loads(command("sweep", "show", table, "--json").out)
    assert found["outcomes"] == {"ended": 2, "refused": 1}
    assert found["spreads"]["result.yaw_rad"]["count"] == 2
    words = shlex.split(found["worst"]["result.yaw_rad"][0]["command"])
    again = command(*words[1:], "--json")
    assert json.loads(again.out)["result"]["yaw_rad"] == found["spreads"]["result.yaw_rad"]["max"]

    assert command("sweep", "show", table, "-o", page).out == f"{page}\n"
    assert "world.coulomb_friction_nm" in page.read_text()

    for row in (0, 2):
        assert command("sweep", "rerun", table, row).out.endswith("the same as in the table\n")
    table.write_text(table.read_text().replace(",1.5,1.5,", ",1.5,1.25,"))
    other = command("sweep", "rerun", table, 1)
    assert other.status == 1
    assert "duration_s is another: 1.25 in the table, 1.5 now" in other.out


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("sweep", "tachobot"), "no file for the table"),
        (("sweep", "tachobot", "-o", "t.csv"), "nothing is varied"),
        (("sweep", "tachobot", "-o", "t.csv", "--vary", "x"), "expected KEY=DISTRIBUTION"),
        (("sweep", "tachobot", "t.csv", "--vary", "a=range(2)"), "expected options only"),
        (("sweep", "nix", "-o", "t.csv", "--vary", "a=range(2)"), "nix: unknown board"),
        (("sweep", "show"), "no FILE; expected sweep show FILE"),
        (("sweep", "show", "none.csv"), "No such file"),
        (("sweep", "show", "none.csv", "-o", "none.csv"), "a name that ends in .html"),
        (("sweep", "rerun", "none.csv"), "no ROW; expected sweep rerun FILE ROW"),
        (("sweep", "rerun", "none.csv", "1", "--set", "a=1"), "belong to a sweep of a board"),
        (
            ("sweep", "tachobot", "-o", "t.csv", "--scheduler", "x", "--workers", "2"),
            "expected one",
        ),
    ],
)
def test_what_cannot_be_is_a_sentence(
    command: Command,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
    sentence: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    ended = command(*words)
    assert (ended.status, ended.out) == (2, "")
    assert sentence in ended.error
    assert list(tmp_path.glob("t.csv*")) == []


def test_words_that_are_none_are_said_with_all_else_that_is_wrong(command: Command) -> None:
    varied = ("--vary", "x", "--vary", "world.mass_kg=uniform(4,2)", "--vary", "world.no=range(2)")
    ended = command("sweep", "tachobot", *varied, "--runs", "0")
    assert ended.status == 2
    for sentence in ("no file for the table", "x: expected KEY", "not below", "--runs: 0"):
        assert sentence in ended.error
