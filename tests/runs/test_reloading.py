"""A board's file read again: when there is time for it, and what becomes of it."""

from pathlib import Path

import pytest
from firmware_drivers.thrust_pairs import ThrustPairs

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs.start import start_session
from firmware_runtime.runs.tuning import NEEDED, TIMEOUT, Reloading
from firmware_runtime.system.messages import Notices

SHIPPED = kinds.shipped_file("tachobot")


class Rig:
    """TachoBot's session, never run, from a file that a test may change."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "board.toml"
        self.path.write_text(SHIPPED.read_text())
        board = registry.load(str(self.path))
        self.session = start_session(board, VirtualClock(), doubles=True, statistics_path=None)
        self.reported: list[str] = []
        executive = self.session.executive
        self.reloading = Reloading(self.session.tuning, executive, Notices(), self.reported.append)
        assert self.reloading in executive.hooks

    def change(self, before: str, after: str) -> None:
        text = self.path.read_text()
        assert before in text
        self.path.write_text(text.replace(before, after))


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    return Rig(tmp_path)


def test_nothing_is_read_until_it_is_requested(rig: Rig) -> None:
    rig.change("kp = 0.75", "kp = 0.5")
    rig.reloading.between_steps(0, NEEDED)
    assert rig.reported == []


def test_it_waits_for_time_enough_before_the_next_activation(rig: Rig) -> None:
    rig.change("kp = 0.75", "kp = 0.5")
    rig.reloading.request()
    rig.reloading.between_steps(0, NEEDED - 1)
    assert rig.reported == []
    rig.reloading.between_steps(MILLISECOND, NEEDED)
    assert rig.reported == [f"reloaded {rig.path}: controller.yaw.kp"]
    rig.reloading.between_steps(2 * MILLISECOND, NEEDED)
    assert len(rig.reported) == 1


def test_a_loop_that_never_has_the_time_reads_it_late(rig: Rig) -> None:
    rig.reloading.request()
    rig.reloading.between_steps(TIMEOUT - 1, 0)
    assert rig.reported == []
    rig.reloading.between_steps(TIMEOUT, 0)
    assert rig.reported == [f"reloaded {rig.path}: nothing new"]


def test_a_file_with_a_fault_changes_nothing(rig: Rig) -> None:
    rig.path.write_text("nothing = sound")
    rig.reloading.request()
    rig.reloading.between_steps(0, NEEDED)
    assert rig.reported[0].startswith("not reloaded, everything stays as it was: ")


def test_a_file_without_end_changes_nothing(rig: Rig) -> None:
    rig.path.write_text("board = " + "[" * 3000)
    rig.reloading.request()
    rig.reloading.between_steps(0, NEEDED)
    assert rig.reported[0].startswith("not reloaded, everything stays as it was: ")


def test_a_file_that_no_reader_foresaw_changes_nothing(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    def load(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr(registry, "load", load)
    rig.reloading.request()
    rig.reloading.between_steps(0, NEEDED)
    assert rig.reported == ["not reloaded, everything stays as it was: MemoryError: "]


def test_what_only_a_new_run_takes_up_is_named(rig: Rig) -> None:
    rig.change("period_s = 0.01", "period_s = 0.02")
    rig.reloading.request()
    rig.reloading.between_steps(0, NEEDED)
    assert rig.reported == [
        f"reloaded {rig.path}: nothing new; only a new run takes up controller.period_s"
    ]


def test_what_only_a_new_run_takes_up_is_not_taken_up_with_the_rest(rig: Rig) -> None:
    """Other channels would be driven, and those driven before left at their last duties."""
    thrust_pairs = rig.session.robot.model.components["thrust_pairs"]
    assert isinstance(thrust_pairs, ThrustPairs)
    rig.change("first_channel = 0", "first_channel = 8")
    rig.change("slew_per_s = 100.0", "slew_per_s = 50.0")
    for _ in range(2):
        rig.reloading.request()
        rig.reloading.between_steps(0, NEEDED)
    assert (thrust_pairs.settings.first_channel, thrust_pairs.settings.slew_per_s) == (0, 50.0)
    left = "only a new run takes up thrust_pairs.first_channel"
    assert rig.reported == [
        f"reloaded {rig.path}: thrust_pairs.slew_per_s; {left}",
        f"reloaded {rig.path}: nothing new; {left}",
    ]


@pytest.mark.parametrize(
    ("name", "why"),
    [("detective", "is now detective, a detective"), ("tachobot", "a kind of board is called so")],
)
def test_a_file_that_has_become_another_robots_changes_nothing(
    rig: Rig, name: str, why: str
) -> None:
    detective = (SHIPPED.parents[1] / "detective" / "board.toml").read_text()
    rig.path.write_text(f'name = "{name}"\n{detective}')
    rig.reloading.request()
    rig.reloading.between_steps(0, NEEDED)
    (reported,) = rig.reported
    assert reported.startswith("not reloaded, everything stays as it was: ")
    assert str(rig.path) in reported
    assert why in reported


def test_what_the_robot_fails_to_take_up_leaves_everything_as_it_was(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    def take_up(_: object) -> None:
        raise ConfigError.of_one("robot tachobot", "retune: KeyError: 'gone'")

    monkeypatch.setattr(rig.session.tuning, "take_up", take_up)
    rig.reloading.request()
    rig.reloading.between_steps(0, NEEDED)
    (said,) = rig.reported
    assert said.startswith("not reloaded, everything stays as it was: robot tachobot: retune")
