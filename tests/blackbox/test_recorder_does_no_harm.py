"""A recorder changes nothing of a robot, ends no run, and makes none late."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.functions import Wrapped
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.hal.interlock import NotedInterlock
from firmware_runtime.recording.blackbox import keyframe_schedule
from firmware_runtime.recording.blackbox.keyframe_schedule import RESERVE, KeyframeSchedule
from firmware_runtime.recording.blackbox.layout import Size
from firmware_runtime.recording.blackbox.recorder import Recorder
from firmware_runtime.recording.blackbox.ring import AHEAD, STEP, Ring
from firmware_runtime.recording.blackbox.section import Kind, decode, sent_of
from firmware_runtime.recording.blackbox.taps import tap_outputs
from firmware_runtime.recording.blackbox.writer import Pending, Writer


class Speaker(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.word = self.out_port("word", str)


def test_a_send_that_was_kept_before_the_run_is_recorded_too() -> None:
    robot = Coupled("robot")
    one, other = robot.add(Speaker("one")), robot.add(Speaker("other"))
    say = other.word.send
    sent: list[Any] = []
    tap_outputs([one, other], sent)
    say("kept")
    one.word.send("called")
    assert sent == [1, "kept", 0, "called"]


class Listener(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.any = self.in_port("any", list)


def test_what_a_model_of_a_world_sends_is_counted_beside_what_the_robot_has_sent() -> None:
    own, world, recorder = Speaker("own"), Speaker("world"), Recorder(VirtualClock())
    tap_outputs([own, world], recorder.pending.sent)
    send = partial(world.word.send, "hello")
    tapped = recorder.instrument(world, Wrapped(world, send, world.internal, world.external, None))
    own.word.send("so")
    tapped.output()
    assert recorder.pending.sent == [0, "so", 1, "hello"]
    assert recorder.pending.world == [1]


def test_a_value_too_deep_to_be_written_ends_no_run() -> None:
    deep: list[object] = []
    for _ in range(5000):
        deep = [deep]
    recorder = Recorder(VirtualClock())
    recorder.entered(Listener("listener").any, deep)
    assert recorder.warning is not None
    assert recorder.warning.startswith("listener.any: ")


def test_answers_of_an_interlock_are_given_and_noted() -> None:
    recorder, answers = Recorder(VirtualClock()), [True, False]
    asked = recorder.interlock(answers.pop)
    assert [asked(), asked()] == recorder.pending.enabled == [False, True]


class Enabled(NotedInterlock):
    def __call__(self) -> bool:
        return True


def test_what_is_asked_outside_of_a_step_is_a_section_of_its_own() -> None:
    recorder = Recorder(VirtualClock())
    recorder.interlock(lambda: True)()
    recorder.note(Kind.ARMED, extra=True)
    sections = map(decode, recorder.before_the_run)
    found = [(each.kind, each.enabled) for each in sections]
    assert found == [(Kind.OUTSIDE, [True]), (Kind.ARMED, [])]


def test_an_interlock_that_notes_its_answers_itself_is_given_where_to() -> None:
    recorder, interlock = Recorder(VirtualClock()), Enabled()
    assert recorder.interlock(interlock) is interlock
    assert interlock.answers is recorder.pending.enabled


def test_a_section_that_words_cannot_say_either_is_said_to_be_missing() -> None:
    pending, schedule = Pending(), KeyframeSchedule()
    writer = Writer(pending, schedule)
    schedule.due_at = NEVER
    pending.sent.extend([0, "\udc80"])
    writer.write(Kind.OUTSIDE, SECOND)
    pending.entered.append(("port", "\udc80"))
    writer.write(Kind.OUTSIDE, 2 * SECOND)
    said, lost = map(decode, writer.early)
    assert sent_of(said) == [(0, {"unknown": "builtins:str"})]
    assert (lost.kind, lost.at) == (Kind.LOST, 2 * SECOND)
    assert lost.extra.startswith("outside: ")
    assert 2 * SECOND < schedule.due_at < NEVER
    assert not pending


def test_a_recording_is_filled_ahead_where_there_is_time_until_the_next_step(
    tmp_path: Path,
) -> None:
    clock = VirtualClock()
    clock.start(SECOND)
    recorder, ring = Recorder(clock), Ring(tmp_path / "x", Size(2 * AHEAD, 2), b"header")
    recorder.write_into(lambda: ring, [], lambda: Captures(then=None), list, is_real_time=False)
    recorder.go_on(2 * SECOND)
    recorder.begin(SECOND)
    ring.write(bytes(3 * STEP))
    filled = [ring.filled]
    for left in (RESERVE - 1, RESERVE):
        recorder.end(SECOND, SECOND + left)
        filled.append(ring.filled)
    recorder.until = SECOND + RESERVE - 1  # the run ends before
    recorder.end(SECOND, 2 * SECOND)
    assert [each - filled[0] for each in (*filled, ring.filled)] == [0, 0, STEP, STEP]
    ring.close()


def test_a_keyframe_is_taken_only_where_there_is_time_until_the_next_step_and_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    captures, clock, taken = Captures(then=0), VirtualClock(), list[int]()
    monkeypatch.setattr(keyframe_schedule, "monotonic_ns", captures.monotonic_ns)
    clock.start(SECOND)
    recorder, ring = Recorder(clock), Ring(tmp_path / "x", Size(2 * AHEAD, 2), b"header")
    recorder.write_into(lambda: ring, [], lambda: captures, list, is_real_time=True)
    for left, until in ((RESERVE - 1, NEVER), (MILLISECOND, RESERVE - 1), (RESERVE, NEVER)):
        recorder.go_on(SECOND + until)
        recorder.end(SECOND, SECOND + left)
        taken.append(captures.captured - REHEARSED)
    assert taken == [0, 0, 1]
    ring.close()


class Captures:
    """Keyframes that take so long each, ns; one that takes None fails after 100 ms."""

    def __init__(self, *takes: int | None, then: int | None) -> None:
        self.now = 0
        self.captured = 0
        self._takes = [*takes]
        self._then = then

    def capture(self) -> bytes:
        self.captured += 1
        takes = self._takes.pop(0) if self._takes else self._then
        self.now += 100 * MILLISECOND if takes is None else takes
        if takes is None:
            raise ModelError("a lock")
        return b"state"

    def largest(self) -> str:
        return "state"

    def monotonic_ns(self) -> int:
        return self.now


def opened(
    monkeypatch: pytest.MonkeyPatch, captures: Captures, written: list[bytes], *, real: bool = True
) -> KeyframeSchedule:
    """The schedule of a run that begins."""
    monkeypatch.setattr(keyframe_schedule, "monotonic_ns", captures.monotonic_ns)
    schedule = KeyframeSchedule()
    schedule.plan(lambda: captures, is_real_time=real)
    schedule.open(written.append)
    return schedule


@pytest.fixture(name="run_with")
def _run_with(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[int]]:
    """The instants at which keyframes were taken, of a run with a pause after each step."""

    def run_with(captures: Captures, *, pause: int, until: int) -> list[int]:
        schedule, taken = opened(monkeypatch, captures, []), list[int]()
        for at in range(0, until, pause):
            if at < schedule.due_at or not schedule.has_time(at, pause):
                continue
            begun = captures.now
            if schedule.capture(at) is not None:
                schedule.taken(at, captures.now - begun)
                taken.append(at)
            assert captures.now - begun <= pause, "an activation waited for a keyframe"
        return taken

    return run_with


PAUSE = 10 * MILLISECOND
REHEARSED = 4
"""Keyframes that are captured and thrown away as a run begins."""


def test_one_slow_keyframe_does_not_end_keyframes(run_with: Callable[..., list[int]]) -> None:
    usual = 300 * MICROSECOND
    captures = Captures(*[usual] * 5, 6 * MILLISECOND, then=usual)
    taken = run_with(captures, pause=PAUSE, until=75 * SECOND)
    assert len(taken) >= 14
    assert max(after - before for before, after in pairwise(taken)) < 7 * SECOND


def test_a_while_beside_a_busy_process_does_not_end_keyframes(
    run_with: Callable[..., list[int]],
) -> None:
    usual = 300 * MICROSECOND
    captures = Captures(*[usual] * REHEARSED, *[4 * MILLISECOND] * 4, then=usual)
    taken = run_with(captures, pause=PAUSE, until=300 * SECOND)
    assert max(after - before for before, after in pairwise(taken)) < 75 * SECOND
    assert taken[-1] > 290 * SECOND


def test_one_that_made_something_late_is_tried_ever_more_seldom(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    captures = Captures(*[300 * MICROSECOND] * REHEARSED, then=12 * MILLISECOND)
    schedule, tried = opened(monkeypatch, captures, []), list[int]()
    for at in range(0, 2000 * SECOND, PAUSE):
        if at >= schedule.due_at and schedule.has_time(at, PAUSE):
            begun = captures.now
            assert schedule.capture(at) is not None
            schedule.taken(at, captures.now - begun)
            tried.append(at // SECOND)
    gaps = [after - before for before, after in pairwise(tried)]
    assert len(tried) < 8
    assert gaps[-1] > 10 * gaps[0]


def test_a_first_one_that_is_slow_is_no_measure(run_with: Callable[..., list[int]]) -> None:
    captures = Captures(9 * MILLISECOND, then=MILLISECOND)
    assert run_with(captures, pause=PAUSE, until=SECOND) == [0]


@pytest.mark.parametrize("takes", [12 * MILLISECOND, None], ids=["never time", "fails"])
def test_one_for_which_there_is_never_time_or_that_has_failed_is_not_taken(
    run_with: Callable[..., list[int]], takes: int | None
) -> None:
    captures = Captures(then=takes)
    assert run_with(captures, pause=PAUSE, until=60 * SECOND) == []
    assert captures.captured == REHEARSED


def test_keyframes_that_fail_are_tried_ever_later(run_with: Callable[..., list[int]]) -> None:
    captures = Captures(then=None)
    assert run_with(captures, pause=SECOND, until=600 * SECOND) == []
    assert captures.captured < 18 + REHEARSED
    captures = Captures(*[None] * 8, then=MILLISECOND)
    assert run_with(captures, pause=SECOND, until=600 * SECOND) != []


def test_how_long_a_keyframe_takes_is_known_before_the_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    captures, written = Captures(then=10 * MILLISECOND), list[bytes]()
    schedule = opened(monkeypatch, captures, written)
    assert schedule.has_time(0, 30 * MILLISECOND + RESERVE)
    assert schedule.fault is None
    assert not schedule.has_time(0, 30 * MILLISECOND)
    assert schedule.fault == "it takes longer than there was until the next event"
    schedule.open(written.append)
    assert captures.captured == len(written) == REHEARSED


def test_a_slow_one_is_forgotten_with_time_not_with_each_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    schedule = opened(monkeypatch, Captures(then=300 * MICROSECOND), [])
    schedule.taken(0, 12 * MILLISECOND)
    due, until = schedule.due_at, 60 * SECOND
    again = next(at for at in range(due, until, PAUSE) if schedule.has_time(at, PAUSE))
    assert again - due > SECOND


def test_in_virtual_time_there_is_time_for_any(monkeypatch: pytest.MonkeyPatch) -> None:
    captures = Captures(then=10 * MILLISECOND)
    assert opened(monkeypatch, captures, [], real=False).has_time(0, 0)
    assert captures.captured == 0
