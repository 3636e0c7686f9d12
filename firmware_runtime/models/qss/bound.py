"""The bound of the error of a linear system: at all times, whatever the input does."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.system.packages import module_of_extra

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Numbers: TypeAlias = NDArray[np.floating[Any]]

_WORST_CONDITION = 1e12


def error_bound(matrix: Sequence[Sequence[float]], quanta: Sequence[float]) -> list[float]:
    """By how much each state of x' = A x + B u may be off at any time, in its unit.

    |V| |Re(L)^-1 L| |V^-1| quanta, with A = V L V^-1, for every method here. Raises ModelError for
    a matrix that is not square, not stable or without a full set of eigenvectors, and for quanta
    that are not one number of 0 or more for each of its rows, ConfigError without numpy.
    Source: Cellier and Kofman, Continuous System Simulation, 2006.
    """
    module_of_extra("numpy", "tuning")
    import numpy as np  # noqa: PLC0415 -- a model that is run does not need it

    system, widths = _numbers("matrix", matrix), _numbers("quanta", quanta)
    if system.ndim != 2 or system.shape[0] != system.shape[1] or not system.size:
        raise _refused(f"a matrix of shape {system.shape}", "rows as long as there are rows")
    if widths.shape != system.shape[:1] or (widths < 0.0).any():
        raise _refused(f"quanta {widths}", f"{len(system)} of them, 0 or more")
    values, vectors = np.linalg.eig(system)
    if not (values.real < 0.0).all():
        raise _refused(f"eigenvalues {values}", "negative real parts")
    if not np.linalg.cond(vectors) <= _WORST_CONDITION:
        raise _refused(
            f"eigenvalues {values} without a full set of eigenvectors", "one for each state"
        )
    spread = np.abs(values / values.real)
    bound = np.abs(vectors) @ (spread * (np.abs(np.linalg.inv(vectors)) @ widths))
    return [float(each) for each in bound]


def _numbers(name: str, given: object) -> "Numbers":
    """Return what was given as an array of finite numbers. Raises ModelError."""
    import numpy as np  # noqa: PLC0415 -- as above

    try:
        numbers: Numbers = np.asarray(given, dtype=float)
    except (TypeError, ValueError) as error:
        raise _refused(f"{name} {given!r}", "numbers, in rows of equal length") from error
    if not np.isfinite(numbers).all():
        raise _refused(f"{name} {given!r}", "finite numbers")
    return numbers


def _refused(what: str, expected: str) -> ModelError:
    """The error, in one line: numpy writes a long array in several."""
    return ModelError(" ".join(f"error_bound: {what}; expected {expected}".split()))
