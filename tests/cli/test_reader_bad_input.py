"""What the readers refuse: in one sentence, with status 2, nothing written."""

from pathlib import Path

import pytest

from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.layout import Layout
from tests.support.command import Command

HEADER = {"models": {}, "conditions": {"board": "tachobot"}}


@pytest.fixture(autouse=True)
def path(tmp_path: Path) -> Path:
    """The statistics of a run, where the readers look."""
    (tmp_path / "state").mkdir()
    StatisticsFile(Layout(), HEADER, tmp_path / "state" / "tachobot.stats")
    return tmp_path / "state" / "tachobot.stats"


@pytest.mark.parametrize("place", [".", "/"])
@pytest.mark.parametrize("option", [("stats", "--save"), ("stats", "--prometheus")])
def test_a_place_that_can_be_no_file_is_refused(
    command: Command, option: tuple[str, str], place: str
) -> None:
    said = (
        command.refused(*option, place)
        .removeprefix("firmware-runtime: ")
        .removeprefix(f"{option[1]}: ")
    )
    assert said.startswith(f"{place}: ")


@pytest.mark.parametrize("number", ["1e300", "-1", "0", "nan", "inf", "soon"])
@pytest.mark.parametrize(
    "words",
    [
        ("top", "--interval"),
        ("stats", "--prometheus", "robot.prom", "--every"),
        ("export", "-o", "trace.json", "--last"),
        ("export", "-o", "trace.json", "--when-late"),
    ],
)
def test_a_number_without_meaning_is_refused(
    command: Command, words: tuple[str, ...], number: str
) -> None:
    error = command.refused(*words, number)
    assert error.startswith(f"firmware-runtime {words[0]}: {words[-1]}: {number!r}: expected")
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "idle"),
    [
        (("tachobot", "--statistics", "x.stats"), "BOARD"),
        (("tachobot", "--diff", "a", "b"), "BOARD"),
        (("--merge", "a", "b", "--since", "cursor"), "--since"),
        (("--merge", "a", "b", "--serve", "127.0.0.1:0"), "--serve"),
        (("--diff", "a", "b", "--since", "cursor"), "--since"),
        (("--diff", "a", "b", "--save", "kept"), "--save"),
        (("--diff", "a", "b", "--prometheus"), "--prometheus"),
        (("--diff", "a", "b", "--histogram"), "--histogram"),
        (("--serve", "127.0.0.1:0", "--save", "kept"), "--save"),
    ],
)
def test_an_option_that_would_have_no_effect_is_refused(
    command: Command, words: tuple[str, ...], idle: str
) -> None:
    assert f"{idle} does not go together with --" in command.refused("stats", *words)


@pytest.mark.parametrize("number", ["-1", "1.5", "nan", "\N{SUPERSCRIPT TWO}"])
def test_so_many_worst_there_cannot_be(command: Command, number: str) -> None:
    assert "expected a whole number from 0 on" in command.refused("stats", "--worst", number)


@pytest.mark.parametrize("option", ["--save", "--since"])
def test_a_run_s_own_file_is_not_replaced_by_a_copy(
    command: Command, path: Path, option: str
) -> None:
    before = path.read_bytes()
    assert "the file of a run itself; expected another" in command.refused("stats", option, path)
    assert path.read_bytes() == before
