"""How often the gains of `tune` beat TachoBot's shipped ones on runs they have not seen.

    python -m benchmarks.tuning [--plants N] [--json]

Each plant is TachoBot on its doubles, register by register, with another world: inertia 0.5 to 2
times the shipped one, damping, friction and a delay before the propellers. One run is recorded and
identified, gains are tuned for what comes of it, and both sets then make two other steps with other
noise. Prints the cost of both, the margins on the true plant, and last the share of plants in which
the tuned gains cost less.
"""

import argparse
import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from msgspec import Struct, structs

from benchmarks.shared.seeds import add_seed_options, by_seed
from firmware_runtime.board.registry import load
from firmware_runtime.errors import ConfigError
from firmware_runtime.identification.identified import identify
from firmware_runtime.identification.series import Series
from firmware_runtime.models.plant import SecondOrderPlant
from firmware_runtime.runs.open_board import open_board
from firmware_runtime.tuning.loop import Gains, Loop, margins
from firmware_runtime.tuning.response import EFFORT_S
from firmware_runtime.tuning.search import tune
from firmware_runtime.tuning.task import of_identified, task_of

_RECORDED: Final = ((2.0, 1.0), (5.0, -1.0), (8.0, 0.5), (11.0, 0.7))
"""When the reference changes while it is recorded, and to what."""
_RECORDED_S: Final = 14.0
_UNSEEN: Final = ((0.6, 1), (-1.4, 2))
"""Steps, and what is added to the world's seed."""
_AT_S: Final = 1.5
_WATCHED_S: Final = 6.0
_SENSED_S: Final = 0.01


class Case(Struct, frozen=True):
    """One plant, and what both sets of gains cost on each unseen run."""

    world: dict[str, float]
    gains: dict[str, float]
    shipped_costs: list[float]
    tuned_costs: list[float]
    gain_margin_db: float
    phase_margin_deg: float

    @property
    def is_better(self) -> bool:
        """Whether the tuned gains cost less over all of its unseen runs."""
        return sum(self.tuned_costs) < sum(self.shipped_costs)


@dataclass(frozen=True, slots=True)
class _Recorded:
    given: list[tuple[float, float]]
    measured: list[tuple[float, float]]
    yaw: list[tuple[float, float]]
    commands: list[tuple[float, float]]


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.tuning", description=__doc__)
    add_seed_options(parser, plants=50)
    chosen = parser.parse_args()
    cases = by_seed(judged, chosen)
    print(json.dumps(_as_json(cases)) if chosen.json else "\n".join(_lines(cases)))
    return 0


def judged(seed: int) -> Case:
    """Record, identify, tune, and compare on unseen runs."""
    world = _world(seed)
    board = load("tachobot", [f"{key}={value}" for key, value in world.items()])
    recorded = _run(world, _RECORDED, _RECORDED_S)
    series = Series(*_columns(recorded.given), *_columns(recorded.measured), "rate")
    identified, _ = identify(series, "rotation", board.settings.world.motor_lag_s)
    plant, intervals = of_identified(identified)
    gains = _tuned(task_of(board, plant, intervals, identified.noise))
    shipped: list[float] = []
    tuned: list[float] = []
    for step, other in _UNSEEN:
        unseen = {**world, "world.seed": world["world.seed"] + other}
        for costs, changed in ((shipped, {}), (tuned, gains)):
            run = _run({**unseen, **changed}, ((_AT_S, step),), _AT_S + _WATCHED_S)
            costs.append(_cost(run, step, 2.0 * board.settings.pair_thrust_n))
    true = _true_loop(world, board.settings.world.lever_arm_m)
    found = margins(true, Gains(*gains.values()))
    return Case(world, gains, shipped, tuned, found.gain_db, found.phase_deg)


def _world(seed: int) -> dict[str, float]:
    random = np.random.default_rng(seed)
    inertia = 0.075 * math.exp(random.uniform(math.log(0.5), math.log(2.0)))
    coulomb = inertia * random.uniform(0.05, 0.3)
    return {
        "world.yaw_inertia_kg_m2": inertia,
        "world.yaw_damping_nms": inertia / random.uniform(1.0, 10.0),
        "world.coulomb_friction_nm": coulomb,
        "world.static_friction_nm": coulomb * random.uniform(1.1, 1.6),
        "controller.yaw.delay_s": round(random.uniform(0.0, 0.06), 3),
        "world.seed": 10 * seed + 1,
    }


def _tuned(task: Any) -> dict[str, float]:  # noqa: ANN401 -- as `task_of` makes it
    """The gains by key; the shipped ones where none keep the margins."""
    try:
        gains = tune(task).gains
    except ConfigError:
        gains = task.shipped
    return {f"controller.yaw.{name}": getattr(gains, name) for name in ("kp", "ki", "kd")}


def _run(
    settings: Mapping[str, float], references: Sequence[tuple[float, float]], for_s: float
) -> _Recorded:
    """TachoBot on its doubles in virtual time, its reference changed at these seconds."""
    chosen: dict[str, object] = {**settings, "controller.yaw.reference_rad": 0.0}
    lever_arm_m = 0.2
    found = _Recorded([], [], [], [])
    with open_board("tachobot", doubles=True, clock="virtual", set=chosen) as robot:
        model: Any = robot.model

        def given(at: int, forces: Any) -> None:  # noqa: ANN401
            moment = lever_arm_m * (forces.f1 - forces.f2 + forces.f3 - forces.f4)
            found.given.append((at / 1e9, moment))

        robot.listen(model.controller.forces, given)
        robot.listen(model.imu.sample, lambda at, v: found.measured.append((at / 1e9, v.rate[2])))
        yaw = model.components["world"].yaw_rad
        robot.listen(yaw, lambda at, value: found.yaw.append((at / 1e9, value)))
        commands = model.controller.components["yaw"].command
        robot.listen(commands, lambda at, value: found.commands.append((at / 1e9, value)))
        for begin, reference, end in _spans(references, for_s):
            if begin:
                robot.post(model.yaw_reference, reference)
            robot.run(end - begin)
    return found


def _spans(
    references: Sequence[tuple[float, float]], for_s: float
) -> Iterator[tuple[float, float, float]]:
    every = [(0.0, 0.0), *references]
    ends = [at for at, _ in references] + [for_s]
    for (at, reference), end in zip(every, ends, strict=True):
        yield at, reference, end


def _columns(points: Sequence[tuple[float, float]]) -> tuple[Any, Any]:
    at, values = np.array(sorted(dict(points).items())).T
    return at, values


def _cost(run: _Recorded, step: float, limit: float) -> float:
    """As `tune` has it, of the true yaw: the integral of time and error, and of the effort."""
    period = 0.01
    error = sum((at - _AT_S) * abs(1.0 - yaw / step) * period for at, yaw in run.yaw if at >= _AT_S)
    effort = sum((each / limit) ** 2 * period for at, each in run.commands if at >= _AT_S)
    return error + EFFORT_S * effort


def _true_loop(world: Mapping[str, float], lever_arm_m: float) -> Loop:
    inertia = world["world.yaw_inertia_kg_m2"]
    plant = SecondOrderPlant(
        2.0 * lever_arm_m / inertia, world["world.yaw_damping_nms"] / inertia, 0.03
    )
    return Loop(plant, _SENSED_S + world["controller.yaw.delay_s"], 0.01)


def _as_json(cases: Sequence[Case]) -> dict[str, object]:
    return {
        "plants": len(cases),
        "better": sum(each.is_better for each in cases),
        "share": sum(each.is_better for each in cases) / len(cases),
        "least_gain_margin_db": min(each.gain_margin_db for each in cases),
        "least_phase_margin_deg": min(each.phase_margin_deg for each in cases),
        "cases": [structs.asdict(each) for each in cases],
    }


def _lines(cases: Sequence[Case]) -> Iterator[str]:
    shipped = np.array([sum(each.shipped_costs) for each in cases])
    tuned = np.array([sum(each.tuned_costs) for each in cases])
    yield (
        f"cost of the unseen runs, median: shipped {np.median(shipped):.3f}, "
        f"tuned {np.median(tuned):.3f} s2; ratio {np.median(tuned / shipped):.2f}, "
        f"worst {np.max(tuned / shipped):.2f}"
    )
    yield (
        f"margins on the true plants, least: {min(each.gain_margin_db for each in cases):.1f} dB, "
        f"{min(each.phase_margin_deg for each in cases):.1f} deg"
    )
    better = sum(each.is_better for each in cases)
    share = f"{better / len(cases):.0%}"
    yield f"better than the shipped gains: {better} of {len(cases)} plants, {share}"


if __name__ == "__main__":
    sys.exit(main())
