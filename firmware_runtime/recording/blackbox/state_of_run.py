"""The state of a recorded robot: the same objects, by number, in its run and in its replay."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.errors import text_of
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.recording.blackbox.state.keyframes import StateTable, UnkeepableState
from firmware_runtime.recording.blackbox.tapped_lines import TappedPort, TappedTime
from firmware_runtime.recording.random_state import Places
from firmware_runtime.statistics.file import StatisticsFile

_PARTS: Final = ("simulator", "accounting", "faults", "watches")
"""Of an executive, by which models are scheduled and counted."""
_EDGES: Final = (
    *(TappedPort, TappedTime),
    *(StatisticsFile, AccountedBus),
)


def state_of_run(  # noqa: PLR0913 -- parts of a run
    robot: Robot,
    lines: Lines,
    executive_state: Mapping[str, Any],
    own: frozenset[Atomic],
    edges: Iterable[object] = (),
    *,
    chance: Any = None,  # noqa: ANN401 -- whatever stands in a file
) -> StateTable:
    """The table of a robot that is about to make its first step; a world's models are none of it.

    `edges` are what else a replay has of its own. `chance` is where the process's own generators of
    random numbers stood before the robot was built. Raises UnkeepableState.
    """
    parts = {name: executive_state[name] for name in _PARTS}
    accounts, step = parts["accounting"].accounts, executive_state["step"]
    strange = [each for each in accounts if each.atomic not in own]
    world = [each for each in robot.model.components.values() if not _is_own(each, own)]
    atomics = (each.atomic for each in strange)
    own_edges = (step, lines.interlock, *strange, *atomics, *world, *edges)
    parts["began_at"] = step.began_at  # all else of it is set again by each step
    return StateTable({"robot": robot, **parts}, (*_EDGES, *own_edges), Places(chance))


def why_unkeepable(robot: Robot, lines: Lines) -> str | None:
    """Which attribute of which model cannot be kept, in a sentence; None where all can."""
    try:
        StateTable({"robot": robot}, (*_EDGES, lines.interlock)).capture()
    except UnkeepableState as error:
        return text_of(error)
    return None


def _is_own(component: Component, own: frozenset[Atomic]) -> bool:
    """Whether all of it was there before a world was attached."""
    if isinstance(component, Coupled):
        return all(_is_own(each, own) for each in component.components.values())
    return component in own
