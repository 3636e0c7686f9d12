"""A campaign's page, and the findings that a folder keeps from one campaign to the next."""

from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.strike import Strike
from firmware_runtime.lab.campaign import campaign_page as page
from firmware_runtime.lab.campaign import findings, kept_findings
from firmware_runtime.lab.campaign.campaign_page import campaign_page
from firmware_runtime.lab.campaign.findings import as_in_rows, text_of_test
from firmware_runtime.lab.campaign.kept_findings import (
    keep_findings,
    read_findings,
    rerun_findings,
    watched_code,
)
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.report import Report
from firmware_runtime.lab.campaign.trial import Trial
from firmware_runtime.lab.campaign.verdict import SOUND, Verdict
from firmware_runtime.lab.sweeps.row import Row
from firmware_runtime.view.parts import Card, Lanes, Section, Table, all_parts

MISSION = Mission(board="tachobot", without=("push",))
FOUND = Verdict(outcome="silent", what="it turns", model="imu", at=2 * SECOND)
REPORTED = Verdict(outcome=SOUND, said="imu: Stuck", said_after=SECOND // 10, struck=True)


def row(number: int, verdict: Verdict, kind: str = "freeze", for_s: float | None = 1.0) -> Row:
    return Trial(MISSION, (Strike(kind, "imu", number / 10, for_s),)).row(number, verdict)


ROWS = [
    row(0, FOUND),
    row(1, FOUND, for_s=0.0),
    *(row(n, REPORTED, "nack") for n in range(2, 9)),
    row(9, Verdict(outcome=SOUND), "nack"),
    row(10, Verdict(outcome="lost", what="killed"), "nack"),
]


def report(rows: list[Row]) -> Report:
    return Report(
        board="tachobot",
        space=100,
        rows=rows,
        findings=as_in_rows(rows),
        flakes=0,
        run_again=0,
        never=["flip of imu"],
        left_out=MISSION.without,
    )


def test_each_run_is_a_mark_with_its_words_its_command_and_its_finding() -> None:
    shown = campaign_page(report(ROWS), "all.csv")
    (lanes,) = [each for each in all_parts(shown.parts) if isinstance(each, Lanes)]
    (lane,) = lanes.lanes
    assert (lane.name, len(lane.marks)) == ("imu", len(ROWS))
    by_number = {each.command.split()[-1]: each for each in lane.marks}
    found = by_number["1"]
    assert found.words == "freeze of imu at 0.1 s once: silent: it turns"
    assert (found.at, found.href, found.colour) == (0.1, "#finding-1", "bad")
    assert found.command == "firmware-runtime campaign rerun all.csv 1"
    said = by_number["2"]
    assert said.words == "nack of imu at 0.2 s for 1.0 s: sound, imu: Stuck after 0.1 s"
    assert (said.colour, by_number["9"].colour, by_number["10"].colour) == ("good", "tint", "rest")
    assert said.height != found.height


def test_it_says_what_was_tried_found_and_left() -> None:
    shown = campaign_page(report(ROWS), "all.csv")
    tried = next(each for each in all_parts(shown.parts) if isinstance(each, Table))
    assert [list(each) for each in tried.rows] == [["nack", "9"], ["freeze", "2, 2 found"]]
    (card,) = [each for each in all_parts(shown.parts) if isinstance(each, Card)]
    assert card.title == "finding 1"
    (left,) = [each for each in shown.parts if isinstance(each, Section) and each.title == "Left"]
    assert "89 faults" in repr(left)
    assert "push" in repr(left)
    assert "flip of imu" in repr(left)


def test_of_many_runs_all_with_findings_and_some_others_are_drawn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(page, "MOST_SOUND", 3)
    shown = campaign_page(report(ROWS))
    (lanes,) = [each for each in all_parts(shown.parts) if isinstance(each, Lanes)]
    colours = [mark.colour for mark in lanes.lanes[0].marks]
    assert colours.count("bad") == 2
    assert len(colours) <= 2 + 3
    assert lanes.title.endswith("6 left out")


def test_what_a_campaign_no_longer_finds_is_run_again_and_fixed_when_sound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    outcome = [FOUND]
    monkeypatch.setattr(kept_findings, "alone", lambda trial, **_: trial.row(0, outcome[0]))
    (finding,) = as_in_rows(ROWS[:1])
    assert [each.fixed for each in keep_findings(tmp_path, "tachobot", [finding])] == [""]
    assert read_findings(tmp_path)[0].finding == finding
    assert [each.fixed for each in keep_findings(tmp_path, "tachobot", [])] == [""]
    outcome[0] = REPORTED
    assert [each.outcome for each in rerun_findings(tmp_path)] == [SOUND]
    (fixed,) = read_findings(tmp_path)
    assert fixed.fixed >= fixed.since
    other = replace(finding, kind="nack")
    kept = keep_findings(tmp_path, "detective", [other])
    assert [bool(each.fixed) for each in kept] == [True, False]
    told: Any = replace(report(ROWS), kept=kept).as_json()["fixed"]
    assert [(each["kind"], each["fixed"]) for each in told] == [("freeze", fixed.fixed)]
    (again, _) = keep_findings(tmp_path, "tachobot", [finding])
    assert (again.fixed, again.since) == ("", fixed.since)


def test_a_finding_that_is_another_one_by_now_is_said_to_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = replace(FOUND, outcome="held", what="nothing commands it")
    monkeypatch.setattr(kept_findings, "alone", lambda trial, **_: trial.row(0, now))
    keep_findings(tmp_path, "tachobot", as_in_rows(ROWS[:1]))
    assert main(["campaign", "rerun", str(tmp_path)]) == 1
    first, last = capsys.readouterr().out.splitlines()
    assert first == "now held, nothing commands it; it was: silent of imu: it turns"
    assert last == "0 of 1 fixed"


def test_the_test_of_a_board_that_is_a_file_finds_it_from_any_folder() -> None:
    (finding,) = as_in_rows(ROWS[:1])
    other = replace(finding, mission=replace(finding.mission, board="robots/left.toml"))
    assert f'assert_sound("{Path.cwd()}/robots/left.toml"' in text_of_test(other, "test_it")
    assert 'assert_sound("tachobot"' in text_of_test(finding, "test_it")


def test_what_an_oracle_of_a_test_has_found_is_not_fixed_without_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kept_findings, "alone", lambda trial, **_: trial.row(0, REPORTED))
    (found,) = as_in_rows([row(0, replace(FOUND, outcome="own"))])
    finding = replace(found, needs_oracle=True)
    keep_findings(tmp_path, "tachobot", [finding])
    assert [each.kept.fixed for each in rerun_findings(tmp_path)] == [""]
    (fixed,) = keep_findings(tmp_path, "tachobot", [], oracle=lambda _: None)
    assert fixed.fixed


def test_what_a_rigs_own_oracle_has_found_is_fixed_when_it_is_sound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kept_findings, "alone", lambda trial, **_: trial.row(0, REPORTED))
    keep_findings(tmp_path, "tachobot", as_in_rows([row(0, replace(FOUND, outcome="own"))]))
    assert [bool(each.kept.fixed) for each in rerun_findings(tmp_path)] == [True]


def test_a_campaign_without_findings_leaves_a_folder_that_can_be_read(tmp_path: Path) -> None:
    folder = tmp_path / "found"
    assert keep_findings(folder, "tachobot", []) == []
    assert read_findings(folder) == []
    assert list(rerun_findings(folder)) == []


def test_a_folder_without_findings_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"findings\.json"):
        read_findings(tmp_path)
    (tmp_path / "findings.json").write_text("[3]")
    with pytest.raises(ConfigError, match="expected what `campaign --findings` keeps"):
        read_findings(tmp_path)


@pytest.mark.slow
def test_the_code_of_the_robot_is_watched(tmp_path: Path) -> None:
    keep_findings(tmp_path, "tachobot", as_in_rows(ROWS[:1]))
    names = {each.name for each in watched_code(tmp_path).folders}
    assert {"firmware_runtime", "firmware_drivers", "firmware_boards"} <= names


def test_a_campaign_is_not_sound_where_a_run_was_lost() -> None:
    lost = report(ROWS[-1:])
    assert not lost.is_sound
    with pytest.raises(AssertionError, match=r"1 runs ended in the middle, 0 were others"):
        lost.check()
    report(ROWS[2:10]).check()


def test_a_setting_without_which_there_is_no_board_stays_with_a_finding(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    settings = ("body_sonar.chip=maxbotix", "body_sonar.port=sonar", "world.seed=3")
    mission = Mission(board="detective", assignments=settings)
    struck = Trial(mission, (Strike("scale", "body_sonar", 1.0, 0.0),))

    def again(tried: Trial, *, oracle: object) -> Row:
        assert oracle is None
        if len(set(settings[:2]) & set(tried.mission.assignments)) == 1:
            raise ConfigError.of_one("body_sonar", "no such board")
        return tried.row(0, FOUND)

    monkeypatch.setattr(findings, "alone", again)
    (finding,) = findings.findings_of([struck.row(0, FOUND)], None, None)
    assert finding.mission.assignments == settings[:2]
