"""Where the process's own generators of random numbers stand: of `random`, and of `numpy.random`.

A model that draws from them, instead of from a generator that it has, draws the same in a replay:
a run says where they stood before its robot was built, and its keyframes where they stand, if that
is elsewhere by then. A module that was not imported when the robot was built has no place before
the first keyframe.
"""

import random
import sys
from array import array
from typing import Any, Final

_NUMPY: Final = "numpy.random.mtrand"
_WORDS: Final = "I"


def places() -> list[Any]:
    """Where each stands, as MessagePack has words for it; None for one that is not imported."""
    version, words, gauss = random.getstate()
    numpy = sys.modules.get(_NUMPY)
    of_numpy = None
    if numpy is not None:
        name, key, place, has_gauss, cached = numpy.get_state()
        of_numpy = [name, key.tobytes(), int(place), int(has_gauss), float(cached)]
    return [version, array(_WORDS, words).tobytes(), gauss, of_numpy]


UNKEPT: Final = (
    "random numbers were drawn from the process's own generators (random, numpy.random), which a "
    "world or a thread may have drawn from as well; expected a generator that the model has"
)
"""What to say of a replay that differs, and in which they were drawn from."""


class Places:
    """Where they stand beside a state, given where they stood before the robot was built."""

    def __init__(self, stood: Any) -> None:  # noqa: ANN401 -- as `places`, or what is in a file
        self._stood = stood

    def read(self) -> list[Any] | None:
        """Where they stand; None if that is where they stood."""
        found = places()
        return None if found == self._stood else found

    def put(self, found: list[Any] | None) -> None:
        """Let them stand where `read` has found them."""
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
