"""A robot's processes are on processors of their own, where there are two or more."""

import os
import subprocess

from benchmarks.kills.machines import Machines, machines, one_machine


def test_the_robot_has_one_half_and_the_others_the_other() -> None:
    assert machines({0, 1}) == Machines(frozenset({0}), frozenset({1}))
    assert machines({1, 2, 3, 5}) == Machines(frozenset({1, 2}), frozenset({3, 5}))
    assert machines({4, 6, 7}) == Machines(frozenset({4}), frozenset({6, 7}))


def test_one_processor_is_of_both_and_so_are_all_of_one_machine() -> None:
    assert machines({3}) == Machines(frozenset({3}), frozenset({3}))
    assert one_machine({0, 1}) == Machines(frozenset({0, 1}), frozenset({0, 1}))


def test_what_is_started_on_the_others_is_there_unless_it_is_the_robot_s() -> None:
    allowed = os.sched_getaffinity(0)
    first, last = min(allowed), max(allowed)
    placed = Machines(frozenset({first}), frozenset({last}))
    with placed.on_others():
        process = subprocess.Popen(["sleep", "60"])
        found = os.sched_getaffinity(process.pid)
        placed.move_to_robot(process.pid)
    try:
        assert found == {last}
        assert os.sched_getaffinity(process.pid) == {first}
        assert os.sched_getaffinity(0) == allowed
    finally:
        process.kill()
        process.wait()
