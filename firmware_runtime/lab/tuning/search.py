"""The gains of least cost that keep the margins, searched by scipy, and checked on other runs.

Cost: the integral of time and absolute error over a step, as a share of the step, plus a tenth of a
second for each second of full command. Steps of two sizes are searched on; the margins are those of
the worst of the plants that the identification leaves possible.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, differential_evolution, minimize

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.identification.plant import PlantParameters
from firmware_runtime.lab.tuning.loop import Gains, Loop, Margins, margins
from firmware_runtime.lab.tuning.response import Body, Scenario, cost_of
from firmware_runtime.lab.tuning.task import Task
from firmware_runtime.models.plant import SecondOrderPlant

Place: TypeAlias = NDArray[np.floating[Any]]
GAIN_DB: Final = 6.0
PHASE_DEG: Final = 45.0
_SEEN: Final = (1.0, 0.25)
"""Shares of the typical step that are searched on."""
_UNSEEN: Final = (0.6, -1.5, 0.4, 1.2)
_MOST_PERIODS: Final = 100_000
"""Most periods of one simulated step: a plant that needs more is no robot's."""
_PUSHES: Final = (0.05, 0.1)
"""Share of the limit that pushes from half time on: while it is searched, and in unseen runs."""
_POPULATION: Final = 8
_GENERATIONS: Final = 20
_TRIES: Final = 120
_SLACK: Final = 1.02
"""Margins are kept with so much to spare, so that rounding of gains takes none away."""


@dataclass(frozen=True, slots=True)
class Tuned:
    """The gains found, beside those that were there."""

    gains: Gains
    margins: Margins
    shipped_margins: Margins
    seen: tuple[float, float]
    """Cost with the shipped gains, and with these, where it was searched."""
    unseen: Sequence[tuple[float, float]]
    """Likewise, of each run that was not."""

    @property
    def better(self) -> int:
        """In how many unseen runs it cost less."""
        return sum(tuned < shipped for shipped, tuned in self.unseen)


def tune(task: Task) -> Tuned:
    """The best gains. Raises ConfigError where none keep the margins."""
    push = _PUSHES[0] * task.body.gain * task.body.limit
    seen = list(_scenarios(task, _SEEN, seed=1, push=push))
    best: list[tuple[float, Gains]] = []

    def judged(place: Place) -> float:
        gains = _gains(place)
        lacking = _lacking(_worst(task, gains))
        cost = _mean(task.body, gains, seen)
        if lacking == 0.0:
            best.append((cost, gains))
        return math.log(cost) + 10.0 * lacking

    _search(judged, Bounds(*np.transpose(_bounds(task))))
    if not best:
        fault = f"none found with {GAIN_DB:g} dB and {PHASE_DEG:g} deg; expected a shorter delay"
        raise ConfigError("gains", [fault])
    gains = _rounded(min(best, key=lambda each: each[0])[1])
    unseen = [
        (cost_of(body, task.shipped, each), cost_of(body, gains, each))
        for body, each in unseen_runs(task)
    ]
    return Tuned(
        gains=gains,
        margins=_worst(task, gains),
        shipped_margins=_worst(task, task.shipped),
        seen=(_mean(task.body, task.shipped, seen), _mean(task.body, gains, seen)),
        unseen=unseen,
    )


def _search(judged: Callable[[Place], float], bounds: Bounds) -> None:
    """Have places judged until the least is near: everywhere, then about the best."""
    found = differential_evolution(
        judged, bounds, seed=1, popsize=_POPULATION, maxiter=_GENERATIONS, polish=False, tol=1e-4
    )
    minimize(
        judged,
        found.x,
        method="Nelder-Mead",
        bounds=bounds,
        options={"maxfev": _TRIES, "xatol": 1e-3},
    )


def unseen_runs(task: Task) -> Iterator[tuple[Body, Scenario]]:
    """Other steps, other noise, a push, and every plant that is possible."""
    for number, plant in enumerate((task.body.plant, *task.possible)):
        body = replace(task.body, plant=plant)
        push = _PUSHES[1] * body.gain * body.limit
        for each in _scenarios(task, _UNSEEN, seed=100 + number, push=push):
            yield body, each


def _scenarios(task: Task, shares: Sequence[float], seed: int, push: float) -> Iterator[Scenario]:
    random = np.random.default_rng(seed)
    for share in shares:
        for_s = _watched_s(task, share)
        if not for_s / task.body.period_s <= _MOST_PERIODS:
            fault = (
                f"a step would have to be watched for {for_s:.3g} s, over {_MOST_PERIODS} periods"
            )
            raise ConfigError.of_one("plant", fault, expected="less inertia, or less delay")
        ticks = round(for_s / task.body.period_s)
        noise = random.normal(0.0, task.noise, ticks).tolist() if task.noise else [0.0] * ticks
        yield Scenario(share * task.step, for_s, noise, push)


def _watched_s(task: Task, share: float) -> float:
    """A dozen times what full command would take for the step, and time for all that is late."""
    body = task.body
    force = body.gain * body.limit
    quickest = math.sqrt(abs(share * task.step) * body.plant.inertia / force)
    return 12.0 * quickest + 20.0 * (body.plant.delay_s + body.lag_s + body.period_s)


def _mean(body: Body, gains: Gains, scenarios: Sequence[Scenario]) -> float:
    return sum(cost_of(body, gains, each) for each in scenarios) / len(scenarios)


def _worst(task: Task, gains: Gains) -> Margins:
    """The least margins of all plants that are possible."""
    found = [
        margins(_loop(replace(task.body, plant=plant)), gains)
        for plant in (task.body.plant, *_extremes(task.possible))
    ]
    return replace(
        min(found, key=lambda each: each.phase_deg),
        gain_db=min(each.gain_db for each in found),
        delay_s=min(each.delay_s for each in found),
    )


def _extremes(plants: Sequence[PlantParameters]) -> Iterator[PlantParameters]:
    """The latest of the light and of the heavy."""
    if plants:
        late = max(each.delay_s for each in plants)
        for extreme in (min, max):
            yield replace(extreme(plants, key=lambda each: each.inertia), delay_s=late)


def _loop(body: Body) -> Loop:
    plant = body.plant
    second_order = SecondOrderPlant(
        body.gain / plant.inertia, plant.damping / plant.inertia, body.lag_s
    )
    return Loop(second_order, plant.delay_s, body.period_s)


def _lacking(found: Margins) -> float:
    """Return how far margins are from those required; 0 if they are kept."""
    gain = max(0.0, 1.0 - found.gain_db / (GAIN_DB * _SLACK))
    phase = max(0.0, 1.0 - found.phase_deg / (PHASE_DEG * _SLACK))
    return gain + phase


def _gains(place: Place) -> Gains:
    """Gains of a place in the search: logarithms of kd, of kp over kd, and of ki over kp."""
    kd, of_kp, of_ki = (math.exp(float(each)) for each in place)
    return Gains(kd * of_kp, kd * of_kp * of_ki, kd)


def _bounds(task: Task) -> list[tuple[float, float]]:
    """Crossovers from a fiftieth of what all that is late allows to three times that."""
    body = task.body
    most = 1.0 / (body.plant.delay_s + body.lag_s + 0.5 * body.period_s)
    whole = body.plant.inertia / body.gain
    return [
        (math.log(low), math.log(high))
        for low, high in (
            (0.02 * most * whole, 3.0 * most * whole),
            (0.005 * most, 1.0 * most),
            (1e-5 * most, 0.3 * most),
        )
    ]


def _rounded(gains: Gains) -> Gains:
    """To three figures, as a person would write them."""
    return Gains(*(float(f"{each:.3g}") for each in (gains.kp, gains.ki, gains.kd)))
