"""A circle of one metre in mode `track`: how far off, by what the external position is like.

Errors are the setpoint less the plant's true state, at every setpoint of one whole lap and more,
once the robot has reached the circle. All runs are in virtual time with the same seeds.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

from msgspec import Struct

from firmware_runtime.board.roles import Stage
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.trial import Traced, Trial
from firmware_runtime.view.parts import Series, Span, Table, curve, table

FROM_S: Final = 18.0
"""By then it is on the circle, at its speed."""
FOR_S: Final = 44.0
STOPS_S: Final = 26.0
STOPPED_S: Final = 31.5
"""Just before it gives up where the position stops for good."""
GIVES_UP_S: Final = 14.0
"""Longest time, s, that a run takes whose position stops for good after five seconds."""
SHOWN: Final = ("20 Hz, 0.05 s", "stopped for 2 s")

CASES: Final[Mapping[str, Mapping[str, object]]] = {
    "20 Hz, 0.05 s": {},
    "10 Hz": {"rate_hz": 10.0},
    "30 Hz": {"rate_hz": 30.0},
    "delay 0.1 s": {"delay_s": 0.1},
    "delay 0.2 s": {"delay_s": 0.2},
    "30 % dropped": {"dropout": 0.3},
    "60 % dropped": {"dropout": 0.6},
    "stopped for 2 s": {"outages_s": [[STOPS_S, STOPS_S + 2.0]]},
    "stopped for good": {"outages_s": [[STOPS_S, 1e6]]},
}
"""Changes in `[world.position]` from the first; the rest is 20 Hz and a delay of 0.05 s."""


class Error(Struct, frozen=True):
    """Error of one coordinate, or of the distance: m or rad."""

    rms: float
    largest: float


class Case(Struct, frozen=True):
    """Figures of one case."""

    x: Error
    y: Error
    off: Error
    """The distance from the setpoint."""
    yaw: Error
    speed_at_end_m_s: float
    states: list[str]


class _Sample(NamedTuple):
    """Setpoint and truth at one instant."""

    t_s: float
    goal: tuple[float, float, float]
    true: tuple[float, float, float]

    def error(self, n: int) -> float:
        return self.goal[n] - self.true[n]

    def off(self) -> float:
        return math.hypot(self.error(0), self.error(1))


class _Run(NamedTuple):
    samples: Sequence[_Sample]
    states: Sequence[str]
    speed_m_s: float


def run(trial: Trial) -> Findings:
    """Run every case."""
    runs: dict[str, _Run] = {}
    for number, (name, changes) in enumerate(CASES.items(), 1):
        trial.say(f"[{number}/{len(CASES)}] circle: {name}")
        for_s = STOPPED_S if name == "stopped for good" else FOR_S
        settings = {f"world.position.{key}": value for key, value in changes.items()}
        label = name.replace(" ", "-").replace(",", "").replace("%", "percent")
        with trial.run(Stage.SIMULATION, for_s=for_s, settings=settings, label=label) as ran:
            runs[name] = _read(ran)
    cases = {name: _case(each) for name, each in runs.items()}
    return Findings(
        ours=dict(_ours(cases)),
        sentences=[*_said(cases), _how_it_ends(trial)],
        plots=dict(_plots(runs)),
        data={"": _csv(runs)},
        tables=[_table(cases)],
        details={"cases": cases},
    )


def _read(ran: Traced) -> _Run:
    """Setpoints and truth at the same instants, in one pass through the trace."""
    ports = [*(f"controller.trajectory.{axis}" for axis in ("x", "y", "yaw"))]
    ports += ["world.x", "world.y", "world.yaw_rad", "controller.watch.state"]
    found: dict[str, dict[int, object]] = {port: {} for port in ports}
    for message in ran.messages(*ports):
        found[message["port"]][message["t_ns"]] = message["value"]
    *numbers, states = found.values()
    at = sorted(set.intersection(*({*each} for each in numbers)))
    samples = [
        _Sample(t / 1e9, _triple(numbers[:3], t), _triple(numbers[3:], t))
        for t in at
        if t >= FROM_S * 1e9
    ]
    speeds = [_number(each[at[-1]], "rate") for each in numbers[3:5]]
    return _Run(samples, [str(state) for state in states.values()], math.hypot(*speeds))


def _triple(numbers: Sequence[Mapping[int, object]], t: int) -> tuple[float, float, float]:
    x, y, yaw = (_number(each[t], "position") for each in numbers)
    return x, y, yaw


def _number(value: object, key: str) -> float:
    return float(value[key] if isinstance(value, dict) else value)  # type: ignore[arg-type]


def _case(run: _Run) -> Case:
    x, y, yaw = (_error([each.error(n) for each in run.samples]) for n in range(3))
    off = _error([each.off() for each in run.samples])
    return Case(x, y, off, yaw, run.speed_m_s, [*run.states])


def _error(values: Sequence[float]) -> Error:
    rms = math.sqrt(sum(value * value for value in values) / len(values))
    return Error(rms, max(map(abs, values)))


def _how_it_ends(trial: Trial) -> str:
    """Say how a run ends whose position stops for good; it is meant to fail."""
    settings = {"world.position.outages_s": [[5.0, 1e6]]}
    try:
        with trial.run(Stage.SIMULATION, for_s=GIVES_UP_S, settings=settings, label="given-up"):
            return f"stopped for good: the run went on for {GIVES_UP_S - 5.0:g} s; expected an end"
    except ConfigError as error:
        return f"stopped for good, and on: {'; '.join(error.faults)}"


# What is said of it ------------------------------------------------------------------------------


def _ours(cases: Mapping[str, Case]) -> Iterator[tuple[str, float]]:
    first = cases[SHOWN[0]]
    yield "off_rms_mm", 1e3 * first.off.rms
    yield "off_largest_mm", 1e3 * first.off.largest
    yield "yaw_rms_mrad", 1e3 * first.yaw.rms
    yield "yaw_largest_mrad", 1e3 * first.yaw.largest


def _said(cases: Mapping[str, Case]) -> Iterator[str]:
    for name, case in cases.items():
        yield (
            f"{name}: off by {1e3 * case.off.rms:.1f} mm rms, {1e3 * case.off.largest:.1f} mm at "
            f"most; yaw {1e3 * case.yaw.rms:.1f} mrad rms, {1e3 * case.yaw.largest:.1f} at most"
        )
    gone = cases["stopped for good"]
    spent_s = STOPPED_S - STOPS_S
    yield (
        f"stopped for good: after {spent_s:g} s it moves at {1e3 * gone.speed_at_end_m_s:.1f} mm/s"
        f" and is {gone.states[-1]}"
    )


def _table(cases: Mapping[str, Case]) -> Table:
    columns = ("", "x, mm", "y, mm", "distance, mm", "yaw, mrad", "position")
    rows = [
        (
            name,
            *(_both(each) for each in (case.x, case.y, case.off, case.yaw)),
            ", ".join(each.lower() for each in case.states),
        )
        for name, case in cases.items()
    ]
    return table("Errors over the circle, rms / largest", columns, rows)


def _both(error: Error) -> str:
    return f"{1e3 * error.rms:.1f} / {1e3 * error.largest:.1f}"


def _plots(runs: Mapping[str, _Run]) -> Iterator[tuple[str, Series]]:
    for name, suffix in zip(SHOWN, ("", "stopped"), strict=True):
        samples = runs[name].samples
        goal = curve("setpoint", [each.goal[:2] for each in samples], "dashed")
        true = curve("true", [each.true[:2] for each in samples])
        ends = (-1.2, 1.2)
        yield (
            f"{suffix}-path".strip("-"),
            Series(
                f"Path, {name}", "x, m", "y, m", [goal, true],
                across_ends=ends, up_ends=ends, has_equal_scales=True,
            ),
        )  # fmt: skip
        curves = [
            curve(axis, [(each.t_s, 1e3 * each.error(n)) for each in samples])
            for n, axis in enumerate(("x, mm", "y, mm", "yaw, mrad"))
        ]
        spans = [Span(STOPS_S, STOPS_S + 2.0, "no position")] if suffix else []
        title = f"Setpoint less truth, {name}"
        yield f"{suffix}-errors".strip("-"), Series(title, "s", "error", curves, spans)


def _csv(runs: Mapping[str, _Run]) -> Iterator[str]:
    yield "case,t_s,x_goal_m,y_goal_m,yaw_goal_rad,x_m,y_m,yaw_rad"
    for name, run_ in runs.items():
        for each in run_.samples:
            numbers = ",".join(f"{value:.6f}" for value in (*each.goal, *each.true))
            yield f'"{name}",{each.t_s:.2f},{numbers}'
