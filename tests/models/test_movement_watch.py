"""What is driven and does not move is found; what moves, rests or is off is not."""

import pytest

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.motion import Applied, Motion
from firmware_runtime.models.movement_watch import MovementWatch, MovementWatchSettings
from tests.support.atomic_bench import AtomicBench

SETTINGS = MovementWatchSettings(
    quantity="yaw rate (rad/s)",
    command=0.1,
    still=0.03,
    impulse=0.198,
    again=500 * MILLISECOND,
)


class Bench(AtomicBench):
    """A watch that gets a motion and a command every 10 ms."""

    def __init__(self) -> None:
        super().__init__(MovementWatch("watch", SETTINGS))

    def drive(self, from_ms: int, until_ms: int, command: float, rate: float = 0.0) -> None:
        for at in range(from_ms, until_ms, 10):
            self.put(at, motion=Motion(0.0, rate))
            self.put(at, command=command)


def test_what_is_driven_without_effect_is_found_and_tried_again_after_a_rest() -> None:
    bench = Bench()
    bench.drive(0, 2000, -0.5)  # 0.4 beyond friction: 0.2 in half a second
    assert bench.said["moves"] == [(500, False), (1000, True), (1500, False)]
    first = bench.faults[0]
    assert (first.kind, first.axis, first.consecutive) == ("Implausible", "yaw rate (rad/s)", 1)
    assert first.reason.endswith("is 0, expected more than 0.03 while it is driven by -0.5")


def test_what_moves_now_and_then_or_is_driven_by_less_than_friction_is_not() -> None:
    bench = Bench()
    for begin in range(0, 4000, 400):
        bench.drive(begin, begin + 390, 0.5, rate=0.0)
        bench.drive(begin + 390, begin + 400, 0.5, rate=0.04)
    bench.drive(4000, 9000, 0.1)
    assert bench.said["moves"] == []


def test_what_gains_speed_while_it_is_braked_is_given_up_the_second_time() -> None:
    bench = Bench()
    for at in range(0, 9000, 10):
        bench.drive(at, at + 10, 0.5, rate=-at / 1000)
    assert bench.said["moves"] == [(500, False), (1000, True), (1500, False)]
    assert [at for at, _ in bench.said["contradiction"]] == [1500]
    assert bench.faults[0].reason.endswith(
        "is -0.5, expected slowing down while it is driven by 0.5"
    )


def test_what_is_a_little_slower_in_between_is_given_up_too() -> None:
    bench = Bench()
    bench.drive(0, 600, 0.5, rate=-1.0)
    bench.drive(600, 1700, 0.5, rate=-0.7)
    assert [moves for _, moves in bench.said["moves"]] == [False, True, False]
    assert len(bench.said["contradiction"]) == 1


def test_what_is_braked_within_its_noise_is_not_slower() -> None:
    bench = Bench()
    for at in range(0, 2000, 20):  # less than twice `still` to and fro
        bench.drive(at, at + 10, 0.5, rate=-1.0)
        bench.drive(at + 10, at + 20, 0.5, rate=-1.0 + 0.055)
    assert next(moves for _, moves in bench.said["moves"]) is False
    slower = Bench()
    for at in range(0, 2000, 20):
        slower.drive(at, at + 10, 0.5, rate=-1.0)
        slower.drive(at + 10, at + 20, 0.5, rate=-1.0 + 0.065)
    assert slower.said["moves"] == []


def test_what_is_half_as_fast_in_between_is_tried_again_for_ever() -> None:
    bench = Bench()
    for begin in range(0, 9000, 1000):
        bench.drive(begin, begin + 600, 0.5, rate=-1.0)
        bench.drive(begin + 600, begin + 1000, 0.5, rate=-0.4)
    assert [at for at, moves in bench.said["moves"] if not moves] == list(range(500, 9000, 1000))
    assert bench.said["contradiction"] == []


def test_a_push_that_is_braked_is_not() -> None:
    bench = Bench()
    for push in range(0, 4000, 1000):
        for at in range(0, 1000, 10):
            bench.drive(push + at, push + at + 10, 0.5, rate=-2.0 + 0.002 * at)
    assert bench.said["moves"] == []


def test_a_command_to_and_fro_adds_up_to_nothing() -> None:
    bench = Bench()
    for begin in range(0, 8000, 400):
        bench.drive(begin, begin + 400, 0.5 if begin % 800 else -0.5)
    assert bench.said["moves"] == []


@pytest.mark.parametrize("applied", [Applied.NOTHING, Applied.ALL])
def test_what_drove_it_before_it_was_off_or_had_no_command_counts_no_more(
    applied: Applied,
) -> None:
    bench = Bench()
    bench.drive(0, 400, 0.5)
    bench.put(400, applied=applied)
    bench.drive(600, 1000, 0.5)
    bench.put(1000, applied=Applied.ALL)
    bench.drive(1000, 1400, 0.5)
    found = [at for at, _ in bench.said["moves"]]
    assert found == ([] if applied is Applied.NOTHING else [1100])


def test_what_is_off_or_has_no_command_is_not_driven() -> None:
    bench = Bench()
    bench.put(0, applied=Applied.NOTHING)
    bench.drive(0, 3000, 0.8)
    bench.put(3000, applied=Applied.PART)
    for at in range(3000, 9000, 150):  # each a while after the one before has run out
        bench.put(at, command=0.8)
    assert bench.said["moves"] == []
    bench.drive(9000, 9400, 0.8)
    assert [moves for _, moves in bench.said["moves"]] == [False]
