"""Gains on a page: their sliders, a trial on the last run, and the copy of board.toml."""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from firmware_runtime.board.installed import shipped_file
from firmware_runtime.board.local_settings import PLACE
from firmware_runtime.board.retuning import retunable_values
from firmware_runtime.errors import ConfigError
from firmware_runtime.live.tuning_trial import board_file, sliders, trial
from firmware_runtime.view.parts import Part, Section, Series, Table, Text
from tests.support.recorded import record

KP = "controller.yaw.kp"


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("flight") / "flight.recording", "tachobot", 3)


@pytest.fixture(autouse=True)
def _none_in_force(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(PLACE, str(tmp_path / "in_force"))


def within(parts: Iterable[Part]) -> Iterator[Part]:
    """All parts, those of sections too."""
    for each in parts:
        yield each
        if isinstance(each, Section):
            yield from within(each.parts)


def words(parts: list[Part]) -> str:
    return "\n".join(each.text for each in parts if isinstance(each, Text))


def test_a_slider_has_the_value_in_force_the_board_s_and_its_range() -> None:
    board = registry.load("tachobot")
    values = {**retunable_values(board.settings, board.retunable), KP: 2.0}
    found = {each["key"]: each for each in sliders(board, values)}
    assert found.keys() == values.keys()
    kp = found[KP]
    assert (kp["value"], kp["default"], kp["least"], kp["most"]) == (2.0, 0.75, 0.0, None)
    assert kp["text"]
    slew = found["thrust_pairs.slew_per_s"]
    assert (slew["unit"], slew["range"]) == ("1/s", "above 0")
    assert slew["text"] == "Fastest change of a duty, full range per second."
    assert found["thrust_pairs.timeout_s"]["unit"] == "s"
    assert found["controller.yaw.anti_windup"]["type"] == "bool"


def test_what_this_end_does_not_have_is_no_slider() -> None:
    assert [each["key"] for each in sliders(registry.load("tachobot"), {KP: 1.0})] == [KP]


@pytest.mark.slow
def test_a_trial_shows_both_curves_and_says_that_the_loop_is_open(flight: Path) -> None:
    parts = trial(flight, {KP: 1.5, "controller.yaw.anti_windup": False})
    assert f"{KP}=1.5 (in the run 0.75)" in words(parts)
    assert "Open loop" in words(parts)
    plots = [each for each in within(parts) if isinstance(each, Series)]
    command = next(each for each in plots if each.title == "controller.yaw.command_n")
    recorded, tried = command.curves
    assert recorded.name == "recorded"
    assert len(recorded.x) == len(tried.x) > 100
    assert max(y for _, y in tried.points) > max(y for _, y in recorded.points)
    (table,) = (each for each in within(parts) if isinstance(each, Table))
    assert table.rows[0][0] in {each.title for each in plots}


@pytest.mark.slow
def test_a_trial_of_the_end_begins_at_the_keyframe_before(tmp_path: Path) -> None:
    path = record(tmp_path / "longer.recording", "tachobot", 6.5)
    assert "in 6.500 s of the run." in words(trial(path, {KP: 1.5}))
    short = re.search(r"in (\d\.\d+) s of", words(trial(path, {KP: 1.5}, last_s=1.0)))
    assert short is not None
    assert 1.0 <= float(short[1]) < 6.0


@pytest.mark.slow
def test_a_value_that_changes_nothing_says_so(flight: Path) -> None:
    parts = trial(flight, {KP: 0.75})
    assert "No number differs" in words(parts)
    assert not [each for each in within(parts) if isinstance(each, Series)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({}, "nothing is set otherwise"),
        ({KP: float("nan")}, "finite"),
        ({KP: [1]}, "finite"),
        ({KP: -1.0}, "kp"),
        ({"controller.yaw.kx": 1.0}, "kx"),
    ],
)
def test_what_cannot_be_tried_is_refused(
    flight: Path, changes: dict[str, object], why: str
) -> None:
    with pytest.raises(ConfigError, match=why):
        trial(flight, changes)


def test_a_copy_differs_in_the_changed_values_alone() -> None:
    board = registry.load("tachobot")
    values = {**retunable_values(board.settings, board.retunable), KP: 2.5}
    before = shipped_file("tachobot").read_text().splitlines()
    after = board_file(board, {**values, "controller.yaw.anti_windup": False}).splitlines()
    differ = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert differ[0] == ("kp = 0.75", "kp = 2.5")
    assert [b.split("#")[0].strip() for _, b in differ[1:]] == ["anti_windup = false"]


def test_a_copy_is_of_the_file_that_the_run_was_started_with(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(f"# mine\n{shipped_file('tachobot').read_text()}")
    board = registry.load(str(own))
    assert board_file(board, {KP: 2.5}, own).startswith("# mine\n")
    assert not board_file(board, {KP: 2.5}, tmp_path / "gone.toml").startswith("# mine\n")


@pytest.mark.parametrize(
    ("values", "why"),
    [({KP: -1.0}, "kp"), ({"imu.address": 1}, "no such gain"), ({KP: "much"}, "kp")],
)
def test_a_copy_that_would_be_refused_is_not_made(values: dict[str, object], why: str) -> None:
    with pytest.raises(ConfigError, match=why):
        board_file(registry.load("tachobot"), values)
