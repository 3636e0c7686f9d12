"""Deadlines on a path from a sensor to an actuator.

The time of a path starts when a message leaves the sensor's port, at the logical instant of that
step, which is the deadline of the sensor's activation: the sample was due then, and being late
counts. It ends, on the run's clock, when a transition of the actuator's model that read input has
returned, and with it the write to the chip. A sample that leaves while another is on its way looks
at the clock as it was when the output function began.

Whether an answer was caused by a certain sample cannot be seen from outside. So a transition of the
actuator answers all samples that left before it, and the oldest of them is measured. A sample that
is over its limit when the next one leaves is a miss without an answer, and so is one at the end of
the run. With a command a sample, as in a control loop, that is exact.

A path is enabled by its first answer. Before that samples leave and nothing is to be done about
them: a controller waits for a propeller to be armed, a gate is shut. They are counted, and none is
a miss; a path that never was enabled has samples and no answer.
"""

from collections.abc import Sequence
from typing import Any

from msgspec import Struct

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.functions import CONFLUENT, EXTERNAL, EXTERNAL_OF_BOTH
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import NEVER, kept
from firmware_runtime.errors import SettingError
from firmware_runtime.executive.step import Step


class PathDeadline(Struct, frozen=True):
    """A sample that leaves `from_port` is to be in effect at `to_model` within `within_ns`."""

    name: str
    from_port: OutPort[Any]
    to_model: Atomic
    within_ns: int

    def __post_init__(self) -> None:
        """Raise SettingError for ends that are none, or no time within which to answer."""
        source: object = self.from_port
        actuator: object = self.to_model
        within: object = self.within_ns
        if not (isinstance(source, OutPort) and isinstance(actuator, Atomic)):
            ends = f"{source!r} -> {actuator!r}"
            raise SettingError(f"deadline {self.name}: {ends}", expected="an OutPort and an Atomic")
        if not (isinstance(within, int) and within > 0):
            raise SettingError(f"deadline {self.name}: {self.within_ns!r} ns", expected="1 or more")

    def missing_from(self, atomics: Sequence[Atomic]) -> list[str]:
        """Which of its ends are no part of these models, as faults."""
        source, actuator = self.from_port, self.to_model
        return [
            f"deadline {self.name}: {path} is not of an atomic model of this robot"
            for path, atomic in ((source.path, source.owner), (actuator.path, actuator))
            if atomic not in atomics
        ]


class DeadlineWatch:
    """Counts the misses of one deadline.

    During a step it is noted only where in the step a sample left; `answer` and `count_samples` do
    the rest after it.
    """

    def __init__(self, deadline: PathDeadline, simulator: Engine, noted: list[int]) -> None:
        self.deadline = deadline
        self.misses = 0
        self.samples = 0
        self.answers = 0
        self._noted = noted
        self.left: list[int] = []
        """For each sample of the step under way, how much had been noted by then."""
        self._left_at = NEVER
        simulator.listen(deadline.from_port, self._leave)

    def _leave(self, _at: int, _value: object) -> None:
        """A sample leaves the sensor's port."""
        self.left.append(len(self._noted))

    def state(self) -> tuple[int, ...]:
        """Misses, samples, answers, and when the oldest sample on its way left."""
        return self.misses, self.samples, self.answers, self._left_at

    def restore(self, state: tuple[int, ...]) -> None:
        """Have counted that. Raises ValueError for what is no such state."""
        self.misses, self.samples, self.answers, self._left_at = map(kept, state)

    def answer(self, step: Step, place: int, now: int) -> None:
        """The actuator's model has read input and written its outputs, as the clock said `now`.

        So much had been noted in the step by then.
        """
        if self.left:
            self.count_samples(step, place)
        self.answers += 1
        if now - self._left_at > self.deadline.within_ns:
            self.misses += 1
        self._left_at = NEVER

    def count_samples(self, step: Step, place: int) -> None:
        """Count the samples that left before so much had been noted in the step."""
        while self.left and self.left[0] <= place:
            before = self.left.pop(0)
            now = step.laps.noted[before - 2] - step.epoch if before else step.started
            self.samples += 1
            is_missed = now - self._left_at > self.deadline.within_ns
            if self.answers > 0 and is_missed:
                self.misses += 1
            if self.answers == 0 or self._left_at == NEVER or is_missed:
                self._left_at = step.at

    def end(self, now: int) -> None:
        """The run is over: what is not answered will not be."""
        if self.answers > 0:
            if now - self._left_at > self.deadline.within_ns:
                self.misses += 1
            self._left_at = NEVER


READS_INPUT = frozenset({EXTERNAL, CONFLUENT, EXTERNAL_OF_BOTH})
