"""A recorder changes nothing of a robot, ends no run, and makes none late."""

from typing import Any

import pytest

from firmware_runtime.blackbox import keyframe_schedule
from firmware_runtime.blackbox.keyframe_schedule import RESERVE, KeyframeSchedule
from firmware_runtime.blackbox.models import tap_outputs, untapped_sends
from firmware_runtime.blackbox.recorder import Recorder
from firmware_runtime.blackbox.state.keyframes import StateTable
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.clocks import VirtualClock
from tests.support.nodes import Node


class Sharing:
    """Objects that share their attributes, as `Borg` of the Python Cookbook does."""

    shared: dict[str, Any] = {}

    def __init__(self) -> None:
        self.__dict__ = self.shared


def test_objects_that_share_their_attributes_go_on_to() -> None:
    one, other = Sharing(), Sharing()
    one.first, one.second = 1, 2  # type: ignore[attr-defined]
    table = StateTable({"node": Node(one=one, other=other)})
    state = table.capture()
    one.first = 3  # type: ignore[attr-defined]
    assert other.first == 3  # type: ignore[attr-defined]
    table.restore(state)
    assert other.first == one.first == 1  # type: ignore[attr-defined]


class Speaker(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.word = self.out_port("word", str)


def test_a_send_that_was_kept_before_the_run_is_named() -> None:
    robot = Coupled("robot")
    one, other = robot.add(Speaker("one")), robot.add(Speaker("other"))
    say = other.word.send
    sent: list[Any] = []
    tap_outputs([one, other], sent)
    say("past the recording")
    one.word.send("tapped")
    assert sent == [0, "tapped"]
    said = untapped_sends([one, other])
    assert said is not None
    assert said.startswith("other.word: its `send` was kept before the run")
    assert untapped_sends([one]) is None


class Listener(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.any = self.in_port("any", list)


def test_a_value_too_deep_to_be_written_ends_no_run() -> None:
    deep: list[object] = []
    for _ in range(5000):
        deep = [deep]
    recorder = Recorder(VirtualClock())
    recorder.entered(Listener("listener").any, deep)
    assert recorder.warning is not None
    assert recorder.warning.startswith("listener.any: ")


class Slow:
    """Keyframes that take 10 ms each."""

    def __init__(self) -> None:
        self.now = 0
        self.captured = 0

    def capture(self) -> bytes:
        self.captured += 1
        self.now += 10 * MILLISECOND
        return b"state"

    def largest(self) -> str:
        return "state"

    def monotonic_ns(self) -> int:
        return self.now


def test_how_long_a_keyframe_takes_is_known_before_the_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slow = Slow()
    monkeypatch.setattr(keyframe_schedule, "monotonic_ns", slow.monotonic_ns)
    schedule = KeyframeSchedule()
    schedule.plan(lambda: slow, is_real_time=True)
    schedule.open()
    assert schedule.has_time(20 * MILLISECOND + RESERVE)
    assert schedule.fault is None
    assert not schedule.has_time(20 * MILLISECOND)
    assert schedule.fault == "it takes longer than there was until the next event"
    schedule.open()
    assert slow.captured == 1


def test_in_virtual_time_there_is_time_for_any() -> None:
    slow = Slow()
    schedule = KeyframeSchedule()
    schedule.plan(lambda: slow, is_real_time=False)
    schedule.open()
    assert schedule.has_time(0)
    assert slow.captured == 0
