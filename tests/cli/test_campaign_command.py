"""`campaign`, as a command: its JSON, its status, its table, a row again, and what it refuses."""

from pathlib import Path

import pytest

from tests.support.command import Command


@pytest.mark.slow
def test_a_campaign_prints_its_figures_and_a_row_is_the_same_again(
    command: Command, tmp_path: Path
) -> None:
    table = tmp_path / "table.csv"
    words = ("campaign", "tachobot", "--for", "1.2", "--runs", "6", "--workers", "1")
    found = command.document(*words, "-o", str(table), "--json")
    assert list(found)[-7:] == [
        *("runs", "space", "share", "silent", "crashes", "flakes", "findings"),
    ]
    assert (found["runs"], found["findings"]) == (6, [])
    row = table.read_text(encoding="utf-8").splitlines()[-1].partition(",")[0]
    again = command.document("campaign", "rerun", str(table), row, "--json")
    assert again["is_same"] is True
    ended = command("campaign", "rerun", str(table), row)
    assert ended.status == 0
    assert "the same as in the table" in ended.out


@pytest.mark.slow
def test_of_another_row_it_is_said_that_it_is_another(command: Command, tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    words = ("campaign", "tachobot", "--for", "0.5", "--runs", "1", "--workers", "1")
    assert command(*words, "-o", str(table)).status == 0
    text = table.read_text(encoding="utf-8")
    table.write_text(text.replace(",sound,", ",silent,"), encoding="utf-8")
    ended = command("campaign", "rerun", str(table), "0")
    assert ended.status == 1
    assert "another than in the table: silent" in ended.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("tachobot", "--budget", "soon"), "expected a time such as 90s, 2m or 1h"),
        (("tachobot", "--budget", "0s"), "expected a positive number"),
        (("tachobot", "--runs", "0"), "--runs: 0; expected 1 or more"),
        (("tachobot", "table.csv"), "expected options only"),
        (("tachobit",), "did you mean tachobot"),
        (("rerun",), "no FILE"),
        (("rerun", "absent.csv", "1"), "cannot be read"),
        (("rerun", "absent.csv", "1", "--set", "world.seed=2"), "--set belongs to a campaign"),
    ],
    ids=" ".join,
)
def test_what_cannot_be_is_one_clear_refusal(
    command: Command, words: tuple[str, ...], said: str
) -> None:
    assert said in command.refused("campaign", *words)
