"""scipy's `solve_ivp` on a problem, restarted at each event."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import integrate

from benchmarks.qss.problems import Guard, Problem

_solve_ivp: Any = integrate.solve_ivp
"""Its stubs know no plain sequences."""


def solved(problem: Problem, rtol: float, method: str | None = None) -> tuple[NDArray[Any], int]:
    """The states at the problem's times, a row each, and the number of steps."""
    times, name, now = np.array(problem.times), problem.start, 0.0
    state = list(problem.system.states.values())
    values, steps = np.zeros((len(state), len(times))), 0
    while True:
        mode = problem.modes[name]
        found = _solve_ivp(
            mode.derivative,
            (now, problem.until_s),
            state,
            method=method or problem.peer_method,
            events=[_terminal(guard) for guard in mode.guards],
            rtol=rtol,
            atol=rtol * 1e-2,
            max_step=0.05 if mode.guards else np.inf,
            dense_output=True,
        )
        steps += len(found.t) - 1
        within = (times >= now) & (times <= found.t[-1])
        values[:, within] = found.sol(times[within])
        now, state = float(found.t[-1]), list(found.y[:, -1])
        if found.status != 1 or mode.then is None:
            return values, steps
        name, state = mode.then(now, state)


def _terminal(guard: Guard) -> Callable[[float, Sequence[float]], float]:
    def event(t: float, y: Sequence[float]) -> float:
        return guard(t, y)

    event.terminal = True  # type: ignore[attr-defined]  # solve_ivp reads this
    event.direction = -1.0  # type: ignore[attr-defined]
    return event
