"""The bound of the error of a linear system: at all times, whatever the input does."""

from collections.abc import Sequence

from firmware_runtime.devs.errors import ModelError


def error_bound(matrix: Sequence[Sequence[float]], quanta: Sequence[float]) -> list[float]:
    """By how much each state of x' = A x + B u may be off at any time, in its unit.

    |V| |Re(L)^-1 L| |V^-1| quanta, with A = V L V^-1, for every method here. Raises ModelError for
    a matrix that is not stable or has no full set of eigenvectors.
    Source: Cellier and Kofman, Continuous System Simulation, 2006.
    """
    import numpy as np  # noqa: PLC0415 -- a model that is run does not need it

    values, vectors = np.linalg.eig(np.asarray(matrix, dtype=float))
    if not (values.real < 0.0).all() or np.linalg.cond(vectors) > 1e12:
        raise ModelError(f"error_bound: eigenvalues {values}; expected negative real parts")
    spread = np.abs(values / values.real)
    bound = np.abs(vectors) @ (spread * (np.abs(np.linalg.inv(vectors)) @ np.asarray(quanta)))
    return [float(each) for each in bound]
