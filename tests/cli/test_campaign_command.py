"""`campaign`, as a command: its JSON, its status, its table, a row again, and what it refuses."""

from pathlib import Path

import pytest

from firmware_runtime.lab.campaign.findings import as_in_rows
from firmware_runtime.lab.campaign.kept_findings import keep_findings
from firmware_runtime.lab.sweeps.sweep_table import read_table
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
def test_a_table_is_a_page_and_its_findings_are_run_again(command: Command, tmp_path: Path) -> None:
    table, page, findings = (tmp_path / name for name in ("t.csv", "page.html", "found"))
    words = ("campaign", "tachobot", "--for", "0.5", "--runs", "2", "--workers", "1")
    assert command(*words, "-o", str(table), "--html", str(page)).status == 0
    assert "campaign of 2 of" in page.read_text(encoding="utf-8")
    assert command("campaign", "show", str(table)).out.startswith("2 of ")
    text = table.read_text(encoding="utf-8")
    table.write_text(text.replace(",sound,", ",silent,"), encoding="utf-8")
    shown = command("campaign", "show", str(table), "-o", str(tmp_path / "other.json"))
    assert (shown.status, shown.out.strip()) == (0, str(tmp_path / "other.json"))
    assert command("campaign", "show", str(table), "--html", str(tmp_path / "o.html")).status == 0
    assert (tmp_path / "o.html").stat().st_size > 10_000
    keep_findings(findings, "tachobot", as_in_rows(read_table(table).rows))
    again = command("campaign", "rerun", str(findings))
    assert again.status == 0
    assert "fixed" in again.out.splitlines()[-1]
    document = command.document("campaign", "rerun", str(findings), "--json")
    assert document["left"] == 0


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
        (("show", "table.csv", "-o", "a.html", "--html", "b.html"), "expected one of them"),
        (("tachobit",), "did you mean tachobot"),
        (("rerun",), "no FILE"),
        (("show",), "no FILE"),
        (("show", "absent.csv"), "cannot be read"),
        (("tachobot", "--watch"), "expected --findings FOLDER"),
        (("tachobot", "--watch", "--findings", "absent"), "findings.json"),
        (("tachobot", "--html", "page.txt"), "expected a name that ends in"),
        (("rerun", "absent.csv", "1"), "cannot be read"),
        (("rerun", "absent.csv", "1", "--set", "world.seed=2"), "--set belongs to a campaign"),
    ],
    ids=" ".join,
)
def test_what_cannot_be_is_one_clear_refusal(
    command: Command, words: tuple[str, ...], said: str
) -> None:
    assert said in command.refused("campaign", *words)
