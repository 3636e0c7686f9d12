"""Settings changed while a robot runs; starts that fail one after the other."""

import json
from pathlib import Path
from time import monotonic_ns

import pytest
from firmware_boards.detective.definition import BOARD as DETECTIVE
from firmware_boards.tachobot.settings import TachobotSettings
from firmware_drivers.thrust_pairs import ThrustPairs
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.board.retuning import retunable_values
from firmware_runtime.board.setting_descriptions import described
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs import restarts
from firmware_runtime.runs.restarts import (
    FIRST_PAUSE,
    FORGOTTEN_AFTER,
    HEALTHY_AFTER,
    LONGEST_PAUSE,
    Restarts,
    pause_after,
    read_starts,
)
from firmware_runtime.runs.start import start_session
from firmware_runtime.runs.tuning import NEEDED, TIMEOUT, Reloading, Tuning
from firmware_runtime.statistics.paths import Companion
from firmware_runtime.system.messages import Notices


@pytest.fixture
def tuning() -> Tuning:
    board = registry.load("tachobot")
    return start_session(board, VirtualClock(), doubles=True, statistics_path=None).tuning


def test_several_values_are_taken_up_at_once(tuning: Tuning) -> None:
    assert tuning.set({"controller.yaw.kp": 0.5, "controller.yaw.ki": 1}) == [
        "controller.yaw.kp",
        "controller.yaw.ki",
    ]
    assert tuning.values["controller.yaw.kp"] == 0.5
    assert tuning.values["controller.yaw.ki"] == 1.0
    assert tuning.revision == 1


def test_with_one_that_is_refused_none_is_taken_up(tuning: Tuning) -> None:
    before = tuning.values
    with pytest.raises(ConfigError) as refused:
        tuning.set({"controller.yaw.kp": 0.5, "controller.yaw.ki": -1.0, "imu.bus": "i2c1"})
    assert [fault.partition(":")[0] for fault in refused.value.faults] == [
        "imu.bus",
        "controller.yaw.ki",
    ]
    assert tuning.values == before
    assert tuning.revision == 0


@pytest.mark.parametrize("value", ["much", True, None, [1.0], {"a": 1}, 1e400, -0.1])
def test_a_value_of_another_type_or_out_of_range_is_refused(tuning: Tuning, value: object) -> None:
    with pytest.raises(ConfigError):
        tuning.set({"controller.yaw.kp": value})


def test_what_the_board_itself_refuses_is_refused(tuning: Tuning) -> None:
    with pytest.raises(ConfigError) as refused:
        tuning.set({"thrust_pairs.timeout_s": 0.001})
    assert "two control periods" in refused.value.faults[0]


def test_a_setting_is_described_by_its_schema() -> None:
    board = registry.load("tachobot")
    found = described(board.settings, board.retunable)
    timeout = found["thrust_pairs.timeout_s"]
    assert (timeout.type, timeout.above, timeout.most) == ("float", 0, 1e9)
    assert "switched off" in timeout.text
    assert found["controller.yaw.anti_windup"].type == "bool"
    assert found["controller.yaw.kp"].range == "from 0"


def test_every_retunable_key_is_described() -> None:
    for name in ("tachobot", "detective"):
        board = registry.load(name)
        found = described(board.settings, board.retunable)
        assert list(found) == list(retunable_values(board.settings, board.retunable))
    assert DETECTIVE.retunable


def test_what_the_robot_fails_to_take_up_is_refused_and_undone() -> None:
    board = registry.load("tachobot")
    taken: list[float] = []

    def retune(settings: TachobotSettings) -> None:
        taken.append(settings.controller.yaw.kp)
        if settings.controller.yaw.kp == 0.5:
            raise KeyError("gone")

    tuning = Tuning(board, retune)
    with pytest.raises(ConfigError) as refused:
        tuning.set({"controller.yaw.kp": 0.5})
    assert refused.value.faults == ("retune: KeyError: 'gone'",)
    assert (taken, tuning.values["controller.yaw.kp"], tuning.revision) == ([0.5, 0.75], 0.75, 0)
    assert tuning.set({"controller.yaw.kp": 0.6}) == ["controller.yaw.kp"]


def test_a_robot_that_takes_up_nothing_any_more_ends_its_run_with_a_sentence() -> None:
    def retune(_: object) -> None:
        raise KeyError("gone")

    with pytest.raises(ModelError, match="its gains are not known any more"):
        Tuning(registry.load("tachobot"), retune).set({"controller.yaw.kp": 0.5})


SHIPPED = kinds.shipped_file("tachobot")
UNCHANGED = "not reloaded, everything stays as it was: "


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

    def reload(self) -> list[str]:
        """Read the file again, with time enough; return what is reported of it."""
        self.reported.clear()
        self.reloading.request()
        self.reloading.between_steps(0, NEEDED)
        return self.reported


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    return Rig(tmp_path)


def test_nothing_is_read_until_it_is_requested(rig: Rig) -> None:
    rig.change("kp = 0.75", "kp = 0.5")
    rig.reloading.between_steps(0, NEEDED)
    assert rig.reported == []


def test_it_waits_for_time_enough_before_the_next_activation(rig: Rig) -> None:
    rig.change("kp = 0.75", "kp = 0.5")
    assert not rig.session.executive.inbox.is_woken
    rig.reloading.request()
    assert rig.session.executive.inbox.is_woken, "else a loop would wait for its next step first"
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


DETECTIVES_FILE = (SHIPPED.parents[1] / "detective" / "board.toml").read_text()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("nothing = sound", "board.toml"),
        ("board = " + "[" * 3000, "board.toml"),
        (DETECTIVES_FILE, "board: 'detective': expected 'tachobot', the kind that runs"),
        (f'name = "other"\n{SHIPPED.read_text()}', "is now of other; expected tachobot"),
        (f'name = "detective"\n{SHIPPED.read_text()}', "a kind of board is called so"),
        (SHIPPED.read_text() + "#" * registry.MOST_WHILE_RUNNING, "at most while the robot runs"),
    ],
    ids=["a fault", "no end", "another kind's", "another robot's", "a kind's", "a long one"],
)
def test_a_file_of_no_use_changes_nothing(rig: Rig, text: str, why: str) -> None:
    rig.path.write_text(text)
    (reported,) = rig.reload()
    assert reported.startswith(UNCHANGED)
    assert str(rig.path) in reported
    assert why in reported


def test_a_file_of_another_kind_takes_no_time_of_the_loop(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its package would be imported: 0.1 s and more, in which the robot's outputs time out."""
    monkeypatch.setattr(registry, "definition", lambda kind: pytest.fail(f"imports {kind}"))
    rig.path.write_text('board = "detective"')
    (reported,) = rig.reload()
    assert reported.startswith(UNCHANGED)


@pytest.mark.parametrize(
    ("owner", "error", "said"),
    [
        ("registry.load", MemoryError(), "MemoryError: "),
        ("take_up", ConfigError.of_one("robot", "KeyError: 'gone'"), "robot: KeyError: 'gone'"),
    ],
)
def test_what_no_reader_or_robot_foresaw_changes_nothing(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, owner: str, error: Exception, said: str
) -> None:
    def fail(*_: object, **_named: object) -> None:
        raise error

    if owner == "take_up":
        monkeypatch.setattr(rig.session.tuning, "take_up", fail)
    else:
        monkeypatch.setattr(registry, "load", fail)
    assert rig.reload() == [f"{UNCHANGED}{said}"]


def test_what_only_a_new_run_takes_up_is_named_and_not_taken_up_with_the_rest(rig: Rig) -> None:
    """Other channels would be driven, and those driven before left at their last duties."""
    thrust_pairs = rig.session.robot.model.components["thrust_pairs"]
    assert isinstance(thrust_pairs, ThrustPairs)
    rig.change("first_channel = 0", "first_channel = 8")
    rig.change("slew_per_s = 100.0", "slew_per_s = 50.0")
    left = "only a new run takes up thrust_pairs.first_channel"
    assert rig.reload() == [f"reloaded {rig.path}: thrust_pairs.slew_per_s; {left}"]
    assert rig.reload() == [f"reloaded {rig.path}: nothing new; {left}"]
    assert (thrust_pairs.settings.first_channel, thrust_pairs.settings.slew_per_s) == (0, 50.0)


@pytest.fixture
def statistics(tmp_path: Path) -> Path:
    return tmp_path / "state" / "tachobot.stats"


def failing(statistics: Path, starts: int) -> Restarts:
    """The last of so many starts, none of which was forgotten."""
    for _ in range(starts):
        last = Restarts(statistics)
        last.begin()
    return last


def test_pauses_double_from_half_a_second_to_thirty() -> None:
    pauses = [pause_after(failed) / SECOND for failed in range(9)]
    assert pauses == [0.5, 0.5, 1, 2, 4, 8, 16, 30, 30]


@given(st.integers(0, 10**9))
def test_no_pause_is_outside_of_these(failed: int) -> None:
    assert FIRST_PAUSE <= pause_after(failed) <= LONGEST_PAUSE
    assert pause_after(failed + 1) >= pause_after(failed)


def test_the_first_start_and_the_one_after_one_failure_wait_no_longer_than_systemd(
    statistics: Path,
) -> None:
    waits = [failing(statistics, 1).wait / SECOND for _ in range(5)]
    assert waits == [0, 0, 0.5, 1.5, 3.5]


def test_what_a_start_left_is_read_by_others(statistics: Path) -> None:
    assert read_starts(statistics) is None
    failing(statistics, 3)
    starts = read_starts(statistics)
    assert starts is not None
    assert starts.failed == 2
    assert Companion.STARTS.beside(statistics).stat().st_mode & 0o777 == 0o640


def test_a_run_that_lasted_a_minute_begins_the_count_again(statistics: Path) -> None:
    last = failing(statistics, 5)
    last.between_steps(HEALTHY_AFTER - 1, SECOND)
    last.between_steps(HEALTHY_AFTER, 0)
    assert Companion.STARTS.beside(statistics).exists()
    last.between_steps(HEALTHY_AFTER + 1, SECOND)
    assert Restarts(statistics).failed == 0


def test_a_loop_that_never_has_time_is_forgotten_all_the_same(statistics: Path) -> None:
    last = failing(statistics, 2)
    last.between_steps(HEALTHY_AFTER + SECOND, 0)
    assert Restarts(statistics).failed == 0


def test_a_start_of_long_ago_says_nothing(
    statistics: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing(statistics, 3)
    later = monotonic_ns() + FORGOTTEN_AFTER + SECOND
    monkeypatch.setattr(restarts, "monotonic_ns", lambda: later)
    assert Restarts(statistics).failed == 0


def test_starts_of_another_boot_do_not_count(statistics: Path) -> None:
    failing(statistics, 3)
    path = Companion.STARTS.beside(statistics)
    kept = json.loads(path.read_text())
    path.write_text(json.dumps({**kept, "boot_id": "another"}))
    assert Restarts(statistics).failed == 0
    path.write_text(json.dumps({**kept, "at_ns": 1 << 62}))
    assert Restarts(statistics).failed == 0


def test_a_service_that_cannot_see_which_boot_it_is_counts_all_the_same(statistics: Path) -> None:
    failing(statistics, 3)
    path = Companion.STARTS.beside(statistics)
    path.write_text(json.dumps({**json.loads(path.read_text()), "boot_id": ""}))
    assert Restarts(statistics).failed == 3


@pytest.mark.parametrize("content", [b"", b"[]", b"{}", b"\xff", b"[" * 3000, b'{"failed": -1}'])
def test_what_is_no_such_file_is_none(statistics: Path, content: bytes) -> None:
    statistics.parent.mkdir()
    Companion.STARTS.beside(statistics).write_bytes(content)
    assert Restarts(statistics).failed == 0
