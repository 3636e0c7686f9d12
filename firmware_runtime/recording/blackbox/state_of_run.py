"""The state of a recorded robot: the same objects, by number, in its run and in its replay.

With it go the places of the process's own generators of random numbers, of `random` and
`numpy.random`. A model that draws from them, instead of from a generator that it has, draws the
same in a replay: a run says where they stood before its robot was built, and its keyframes where
they stand, if that is elsewhere by then. numpy loads its own late, mostly when it is first drawn
from: then it begins where `random` stood before the robot was built, in the run as in its replay.
"""

import random
import sys
from array import array
from collections.abc import Iterable, Mapping, Sequence
from hashlib import sha256
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final, cast

from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.errors import text_of
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.recording.blackbox.state.keyframes import StateTable, UnkeepableState
from firmware_runtime.recording.blackbox.taps import TappedPort, TappedTime
from firmware_runtime.statistics.file import StatisticsFile

if TYPE_CHECKING:
    from importlib.abc import Loader  # of which Python itself makes use only for types

_NUMPY: Final = "numpy.random.mtrand"
_LOADS_IT: Final = "numpy.random"
_WORDS: Final = "I"


def places() -> list[Any]:
    """Return the place of each, as MessagePack has words for it; None for one not imported."""
    version, words, gauss = random.getstate()
    numpy = sys.modules.get(_NUMPY)
    of_numpy = None
    if numpy is not None:
        name, key, place, has_gauss, cached = numpy.get_state()
        of_numpy = [name, key.tobytes(), int(place), int(has_gauss), float(cached)]
    return [version, array(_WORDS, words).tobytes(), gauss, of_numpy]


class _Seeding:
    """Lets `numpy.random` begin at a place of its own, whenever it is loaded; then goes."""

    def __init__(self, seed: Sequence[int]) -> None:
        self._seed = seed
        self._loader: Any = None

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find the module as Python does, to be loaded here."""
        if name != _LOADS_IT:
            return None
        sys.meta_path.remove(self)
        spec = PathFinder.find_spec(name, path, target)
        if spec is not None and spec.loader is not None:
            self._loader, spec.loader = spec.loader, cast("Loader", self)
        return spec

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """Make the module as Python does."""
        made: ModuleType | None = self._loader.create_module(spec)
        return made

    def exec_module(self, module: ModuleType) -> None:
        """Load it, and let it begin there."""
        if module.__spec__ is not None:
            module.__spec__.loader = module.__loader__ = self._loader
        self._loader.exec_module(module)
        module.__dict__["seed"](self._seed)


def begin_late(stood: Any) -> None:  # noqa: ANN401 -- as `places`, or what is in a file
    """Let `numpy.random` begin where `random` stood, if it had not been loaded by then."""
    try:
        _, words, _, of_numpy = stood
        seed = array(_WORDS, sha256(words).digest()).tolist()
    except (TypeError, ValueError):
        return
    for each in [each for each in sys.meta_path if isinstance(each, _Seeding)]:
        sys.meta_path.remove(each)
    if of_numpy is not None:
        return
    loaded = sys.modules.get(_LOADS_IT)
    if loaded is None:
        sys.meta_path.insert(0, _Seeding(seed))
    else:
        loaded.__dict__["seed"](seed)


UNKEPT: Final = (
    "random numbers were drawn from the process's own generators (random, numpy.random), which a "
    "world or a thread may have drawn from as well; expected a generator that the model has"
)
"""Sentence on a replay that differs, and in which they were drawn from."""


class Places:
    """Places of generators beside a state, given where they stood before the robot was built."""

    def __init__(self, stood: Any) -> None:  # noqa: ANN401 -- as `places`, or what is in a file
        self._stood = stood

    def read(self) -> list[Any] | None:
        """Return the places; None if they stand where they stood."""
        found = places()
        return None if found == self._stood else found

    def put(self, found: list[Any] | None) -> None:
        """Let them stand where `read` has found them."""
        begin_late(self._stood)
        put(self._stood if found is None else found)


def put(places: Any) -> None:  # noqa: ANN401 -- whatever stands in a file
    """Let them stand there. What is no place leaves them as they are."""
    before = random.getstate()
    try:
        version, words, gauss, of_numpy = places
        random.setstate((version, tuple(array(_WORDS, words)), gauss))
        if of_numpy is not None:
            import numpy as np  # noqa: PLC0415 -- heavy

            name, key, *others = of_numpy
            words = np.frombuffer(key, np.uint32)
            np.random.set_state((name, words, *others))  # noqa: NPY002 -- models draw from it
    except Exception:  # noqa: BLE001 -- whatever stands in a file
        random.setstate(before)


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
