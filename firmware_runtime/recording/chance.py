"""Where the process's own generators of random numbers stand: of `random`, and of `numpy.random`.

A model that draws from them, instead of from a generator that it has, draws the same in a replay
that begins at the start of the run. Their place is no part of a keyframe. A module that was not
imported yet has no place; what it draws is not repeated.
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
    "a model draws random numbers from the process's own generators (random, numpy.random); "
    "expected a generator that it has, which is part of its state"
)
"""What to say of a replay that differs, and in which they were drawn from."""


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
    except (TypeError, ValueError, OverflowError, ImportError):
        random.setstate(before)
