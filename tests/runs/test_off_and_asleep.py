"""Outputs that stay off, the last `safe-state`, machines that sleep, lines that are soon free."""

from collections.abc import Iterator
from itertools import chain, cycle, repeat
from pathlib import Path
from time import monotonic_ns

import pytest

from firmware_runtime.board import registry
from firmware_runtime.board.robot import Lines
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import Clock, MonotonicClock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.interlock import EnableLine
from firmware_runtime.hal.unopened_lines import AbsentBus, NotingBus
from firmware_runtime.hal.wire_errors import BusFault, BusInUse
from firmware_runtime.runs import outputs, supervision
from firmware_runtime.runs import safe_state as module
from firmware_runtime.runs.arming import Arming, Permission
from firmware_runtime.runs.open_lines import close_lines, soon_free
from firmware_runtime.runs.safe_state import BETWEEN, SafeState
from firmware_runtime.runs.start import start_session
from firmware_runtime.runs.supervision import SleepWatch, watch_sleep
from firmware_runtime.runs.watched_run import (
    last_safe_state,
    note_safe_state,
    safe_state_files,
)
from firmware_runtime.system import resources
from firmware_runtime.system.this_process import boot_id, slept
from tests.support.periodic_models import Robot

ON = ["PCA9685 at 0x40 on i2c1: outputs 0 are on"]


class Closing(NotingBus):
    """Notes whether it was closed."""

    is_closed = False

    def close(self) -> None:
        self.is_closed = True


class Lights:
    """Outputs of a chip that are on as they are told to be."""

    def __init__(self, seen: Iterator[list[str]]) -> None:
        self.seen = seen

    def outputs_on(self) -> list[str]:
        return next(self.seen)

    def make_safe(self) -> list[str]:
        return []


class Watching:
    """A safe-state whose board another process drives, on a clock that its waits move."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, seen: Iterator[list[str]]) -> None:
        self.now = 0
        monkeypatch.setattr(module, "monotonic_ns", lambda: self.now)
        self.safe_state = SafeState([], None, None)
        monkeypatch.setattr(self.safe_state, "_outputs", [Lights(seen)])
        monkeypatch.setattr(self.safe_state, "_is_driven", True)
        monkeypatch.setattr(self.safe_state, "_is_known", True)

    def wait(self) -> bool:
        self.now += BETWEEN
        return False

    def result(self) -> list[str]:
        return self.safe_state.stays_off(2 * SECOND, self.wait)


def test_what_is_off_only_in_the_last_look_was_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """What drives it was late by a period just then."""
    looks = 2 * SECOND // BETWEEN
    for seen in (cycle([ON, []]), chain(repeat(ON, looks), repeat([]))):
        assert Watching(monkeypatch, seen).result() == ON


def test_what_stays_off_after_it_was_on_is_off(monkeypatch: pytest.MonkeyPatch) -> None:
    assert Watching(monkeypatch, chain([ON], repeat([]))).result() == []


class Rig:
    """A run that never begins, armed, on a machine that sleeps when it is told to."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.asleep = 0
        self.now = 10 * SECOND
        patch.setattr(supervision, "slept", lambda: self.asleep)
        self.logged: list[str] = []
        self.executive = Executive(Robot(), MonotonicClock(), list, Configuration())
        permission = Permission(at_start=False, demand_guard=False)
        self.arming = Arming(self.executive, permission, list, log=self.logged.append)
        self.watch = SleepWatch(self.arming)
        assert self.arming.request(0) == []

    def go_on(self, asleep: int) -> None:
        """Sleep for so long, then come to the next pass of the loop."""
        self.now += SECOND
        self.asleep += asleep
        self.watch.between_steps(self.now, 0)


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Rig:
    return Rig(monkeypatch)


def test_a_run_on_a_machine_that_stays_awake_stays_armed(rig: Rig) -> None:
    for _ in range(3):
        rig.go_on(asleep=0)
    assert rig.arming.interlock()


def test_a_run_whose_machine_slept_is_disarmed_until_it_is_armed_again(rig: Rig) -> None:
    rig.go_on(asleep=90 * SECOND)
    assert not rig.arming.interlock()
    assert rig.logged[-1] == "disarmed: the machine slept for 90.0 s"
    assert rig.arming.request(0) == []
    rig.go_on(asleep=0)
    assert rig.arming.interlock()


def test_a_sleep_while_it_was_disarmed_counts_for_nothing_later(rig: Rig) -> None:
    rig.arming.disarm("by request")
    rig.go_on(asleep=90 * SECOND)
    assert rig.arming.request(0) == []
    rig.go_on(asleep=0)
    assert rig.arming.interlock()


@pytest.mark.parametrize(
    ("clock", "free", "watched"),
    [
        (MonotonicClock(), False, True),
        (MonotonicClock(), True, False),
        (VirtualClock(), False, False),
    ],
)
def test_it_is_watched_where_something_may_be_hurt(
    clock: Clock, *, free: bool, watched: bool
) -> None:
    executive = Executive(Robot(), clock, list, Configuration())
    permission = Permission(at_start=False, demand_guard=False, free=free)
    watch_sleep(executive, Arming(executive, permission, list))
    assert any(isinstance(each, SleepWatch) for each in executive.hooks) is watched


def test_a_run_that_is_to_be_armed_is_watched_for_it() -> None:
    board, permission = registry.load("tachobot"), Permission(at_start=False, demand_guard=False)
    clock = MonotonicClock()
    session = start_session(board, clock, doubles=True, statistics_path=None, permission=permission)
    assert any(isinstance(each, SleepWatch) for each in session.executive.hooks)
    session.close()


def test_the_clocks_of_this_machine_stay_together_while_it_is_awake() -> None:
    before = slept()
    assert abs(slept() - before) < SECOND


def test_lines_are_opened_again_after_a_failure_and_kept_open_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As a guard does while an adapter is gone, which may come back as another node."""
    bus = Closing("i2c1", "/dev/i2c-1", [])
    there: list[I2cBus] = [AbsentBus("i2c1"), bus]
    monkeypatch.setattr(outputs, "reach_lines", lambda *_: Lines({"i2c1": there.pop(0)}))
    held = outputs.Outputs(registry.load("tachobot"), None, None)
    assert held.make_safe() != []
    assert held.make_safe() == []
    assert held.make_safe() == []
    assert not bus.is_closed
    held.close()
    assert bus.is_closed


def test_what_has_switched_a_board_off_lets_its_buses_go(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = Closing("i2c1", "/dev/i2c-1", [])
    monkeypatch.setattr(outputs, "reach_lines", lambda *_: Lines({"i2c1": bus}))
    safe_state = SafeState([registry.load("tachobot")], None, None)
    assert (safe_state.make_safe(), bus.is_closed) == ([], False)
    safe_state.close()
    assert bus.is_closed


def test_an_enable_line_that_fails_keeps_no_bus_open_and_raises_nothing_new() -> None:
    """Its failure is said where outputs are switched off, with the status of that."""

    class Failing(EnableLine):
        name = "output_enable"

        def set(self, enabled: bool) -> None:  # noqa: ARG002, FBT001 -- as of a line
            raise BusFault("line 17 cannot be set", where=self.name)

        def close(self) -> None:
            self.set(False)

    bus = Closing("i2c1", "/dev/i2c-1", [])
    close_lines(Lines({"i2c1": bus}, enable=Failing()))
    assert bus.is_closed


def test_what_another_process_lets_go_is_taken_and_what_it_keeps_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    waits: list[float] = []
    monkeypatch.setattr(resources, "sleep", waits.append)
    monkeypatch.setattr(resources, "monotonic", lambda: sum(waits))
    attempts = iter([True, True, False])

    def take() -> str:
        if next(attempts, True):
            raise BusInUse("i2c1: /dev/i2c-1 is driven by another process")
        return "the bus"

    assert soon_free(take) == "the bus"
    assert len(waits) == 2
    waits.clear()
    with pytest.raises(BusInUse, match="another process"):
        soon_free(take)
    assert 1.0 <= sum(waits) < 1.1


PRESENT = f'"boot_id": "{boot_id()}"'


@pytest.fixture(autouse=True)
def directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    return tmp_path


def last(statistics: Path | None = None) -> int:
    return last_safe_state(safe_state_files("tachobot", statistics))


def test_the_last_call_is_found_wherever_the_run_keeps_its_own(directory: Path) -> None:
    assert last() == 0
    before = monotonic_ns()
    note_safe_state(directory / "tachobot.stats")
    between = monotonic_ns()
    assert (directory / "tachobot.safe-state").stat().st_mode & 0o777 == 0o644, "for any user's run"
    assert before <= last() <= between
    assert last(directory / "mine.stats") == last()
    note_safe_state(directory / "elsewhere" / "mine.stats")
    assert last() <= between <= last(directory / "elsewhere" / "mine.stats") <= monotonic_ns()


@pytest.mark.parametrize(
    "content",
    [
        '{"boot_id": "another", "at_ns": 1}',
        f'{{{PRESENT}, "at_ns": {10**18}}}',
        f'{{{PRESENT}, "at_ns": -1}}',
        "",
        "[" * 100_000,
    ],
)
def test_a_call_of_another_boot_or_of_no_sense_is_none(directory: Path, content: str) -> None:
    path = directory / "tachobot.safe-state"
    path.write_text(content)
    assert last() == 0
    path.write_text(f'{{{PRESENT}, "at_ns": 1}}')
    assert last() == 1
