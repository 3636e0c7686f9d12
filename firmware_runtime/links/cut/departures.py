"""What leaves the model by the ports of a cut, step by step.

A step is one instant and one round of it: what imminent models send together.
"""

from collections import deque
from collections.abc import Callable, Iterator
from itertools import groupby
from operator import itemgetter
from typing import Final, TypeAlias

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.links.cut.cut import Crossing
from firmware_runtime.links.cut.step import HEAD
from firmware_runtime.links.cut.wire import LONGEST_BODY

Left: TypeAlias = dict[Crossing, list[object]]
"""What left in a step, by crossing."""
_place: Final = itemgetter(0)


class Departures:
    """Listens at ports of the cut, for as long as the simulator lives."""

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._left: deque[tuple[tuple[int, int, int], Crossing, object]] = deque()

    def __bool__(self) -> bool:
        """Whether something has left."""
        return bool(self._left)

    def listener(self, crossing: Crossing) -> Callable[[int, object], None]:
        """What listens at the port of a crossing."""
        left, simulator = self._left, self._simulator

        def take(at: int, value: object) -> None:
            left.append(((at, simulator.visit, simulator.round), crossing, value))

        return take

    def steps(self) -> Iterator[tuple[int, Left]]:
        """The steps since the last call: the instant of each, and what left in it."""
        everything = list(self._left)
        self._left.clear()
        for place, departed in groupby(everything, _place):
            left: Left = {}
            for _, crossing, value in departed:
                left.setdefault(crossing, []).append(value)
            yield place[0], left


def packed(left: Left) -> Iterator[tuple[Crossing, int, bytes]]:
    """By crossing how many values left in a step, and their bytes.

    Raises ModelError for what no frame has room for.
    """
    room = LONGEST_BODY
    for crossing, values in left.items():
        body = crossing.packed(values)
        room -= HEAD + len(body)
        if room < 0:
            names = ", ".join(each.name for each in left)
            fault = f"{names}: more left in one step than crosses a link in one frame"
            raise ModelError(fault, expected=f"{LONGEST_BODY} bytes at most, the rest later")
        yield crossing, len(values), body
