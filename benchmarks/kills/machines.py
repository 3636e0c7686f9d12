"""The processors of a robot's machine, and those that stand for other machines.

A controller on another machine takes nothing of the processors on which a robot's loop runs. Where
both are one machine, the robot has one half of its processors, and the other half has all else:
controllers, their carriers, what starts and kills them, and the chips' doubles.
"""

import os
from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Machines:
    """Processors by their numbers; the same ones where there is only one."""

    robot: frozenset[int]
    others: frozenset[int]

    @contextmanager
    def on_others(self) -> Iterator[None]:
        """Within the block this thread, and what it starts, is on another machine."""
        before = os.sched_getaffinity(0)
        os.sched_setaffinity(0, self.others)
        try:
            yield
        finally:
            os.sched_setaffinity(0, before)

    def move_to_robot(self, process: int) -> None:
        """Of a process that has just begun; what it starts later is there, too."""
        os.sched_setaffinity(process, self.robot)

    def report(self) -> dict[str, list[int]]:
        """As JSON."""
        return {"robot": sorted(self.robot), "others": sorted(self.others)}


def machines(processors: AbstractSet[int]) -> Machines:
    """The lower half for the robot, the upper one for the others; the only one for both."""
    every = sorted(processors)
    half = len(every) // 2
    return Machines(frozenset(every[:half] or every), frozenset(every[half:]))


def one_machine(processors: AbstractSet[int]) -> Machines:
    """All for both."""
    return Machines(frozenset(processors), frozenset(processors))
