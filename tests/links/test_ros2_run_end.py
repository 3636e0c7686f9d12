"""What a node knows of its hold on a robot, with a run that answers when a test wants it to."""

import json
from collections.abc import Iterator
from pathlib import Path
from queue import Queue
from threading import Thread

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ControlError
from firmware_runtime.links.ros2 import run_end
from firmware_runtime.links.ros2.run_end import RunEnd
from tests.support.replies import Replies
from tests.support.waiting import PATIENCE_S, wait_until

LEASE_S = 0.4
LEASE = round(LEASE_S * SECOND)


class Clock:
    """The node's clock, by hand."""

    def __init__(self) -> None:
        self.now = 1000 * SECOND

    def __call__(self) -> int:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(run_end, "monotonic_ns", clock)
    return clock


@pytest.fixture
def run(tmp_path: Path) -> Iterator[Replies]:
    with Replies(tmp_path / "robot.stats") as run:
        yield run


def armed(run: Replies) -> RunEnd:
    """The node's end, with the robot armed on a lease."""
    end = RunEnd(run.path)
    run.answer_in_background({"refused": [], "armed": True, "lease": "5f0c"})
    assert end.arm(LEASE_S) == []
    run.wait()
    return met(run, end)


def met(run: Replies, end: RunEnd) -> RunEnd:
    """The same once the run has greeted, and has said nothing else."""

    def is_met() -> bool:
        end.tend()
        return run.has_request()

    wait_until(is_met, "the run is met")
    run.taken()
    return end


def renewed(run: Replies, end: RunEnd) -> None:
    """Send a sign of life, and have it answered; the answer is taken in with the next one."""
    end.tend()
    run.answer(
        {
            "lease": "5f0c",
            "leased": True,
            "run": "a",
            "armed": True,
            "reason": None,
            "revision": 0,
        }
    )


def test_a_node_that_gives_signs_of_life_holds_its_robot(run: Replies, clock: Clock) -> None:
    end = armed(run)
    for _ in range(20):
        assert end.holds_robot
        renewed(run, end)
        clock.now += LEASE // 4
    end.close()


def test_a_node_that_stood_still_knows_that_it_cannot_know(run: Replies, clock: Clock) -> None:
    end = armed(run)
    renewed(run, end)
    clock.now += LEASE + 1
    assert not end.holds_robot
    end.tend()  # takes in what was answered before the standstill
    assert not end.holds_robot
    end.close()


def test_a_node_that_stood_still_for_less_than_its_lease_goes_on(
    run: Replies, clock: Clock
) -> None:
    end = armed(run)
    renewed(run, end)
    clock.now += LEASE - MILLISECOND
    assert end.holds_robot
    renewed(run, end)
    end.tend()
    clock.now += LEASE - MILLISECOND
    assert end.holds_robot
    end.close()


def test_a_run_that_does_not_answer_in_time_is_asked_to_disarm(
    run: Replies, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_end, "TIMEOUT_S", 0.01)
    end = RunEnd(run.path)
    with pytest.raises(ControlError, match="no answer within"):
        end.arm(60.0)
    said = json.loads(run.next()[0])
    if said["request"] == "arm":  # on a busy machine the time was over before it was greeted
        said = json.loads(run.next()[0])
    assert said == {"request": "disarm"}
    assert end.lease is None
    end.close()


def test_arming_is_asked_for_within_the_time_that_it_is_waited_for(
    run: Replies, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_end, "TIMEOUT_S", PATIENCE_S)
    end = RunEnd(run.path)
    asked = Queue[str]()
    answering = Thread(target=lambda: asked.put(run.answer_bytes(b'{"refused": ["not now"]}')))
    answering.start()
    assert end.arm(60.0) == ["not now"]
    answering.join()
    arm = json.loads(asked.get_nowait())
    assert (arm["request"], arm["lease_s"]) == ("arm", 60.0)
    assert 0 < arm["within_s"] < PATIENCE_S
    end.close()


def test_a_run_that_was_found_is_known_before_it_answers_a_sign_of_life(run: Replies) -> None:
    end = RunEnd(run.path)
    state = {"run": "a", "armed": False, "reason": "not requested yet", "revision": 3}
    run.answer_in_background(state)
    assert end.find().run == "a"
    end.tend()
    assert end.seen is not None
    assert end.seen.revision == 3
    run.wait()
    end.close()


@pytest.mark.parametrize("said", [b"\xff", b"text", b"[]", b'{"run": "b"}', b"[" * 10_000, b"1"])
def test_what_no_run_has_said_is_no_answer(run: Replies, said: bytes) -> None:
    end = met(run, RunEnd(run.path))
    end.tend()
    run.answer_bytes(said)
    renewed(run, end)
    end.tend()
    assert end.seen is not None
    assert end.seen.run == "a"
    end.close()
