"""The systems of docs/qss.md, each for our blocks and, with the same events, for `solve_ivp`."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from firmware_runtime.models.qss import System, When

Derivative: TypeAlias = Callable[[float, Sequence[float]], list[float]]
Guard: TypeAlias = Callable[[float, Sequence[float]], float]


@dataclass(frozen=True)
class Mode:
    """Equations that hold until a guard falls below zero; `then` gives the next mode and start."""

    derivative: Derivative
    guards: Sequence[Guard] = ()
    then: Callable[[float, Sequence[float]], tuple[str, list[float]]] | None = None


@dataclass(frozen=True)
class Problem:
    """A system for us, its modes for the peer, and until when it is solved."""

    name: str
    system: System
    modes: Mapping[str, Mode]
    until_s: float
    start: str = ""
    peer_method: str = "RK45"
    shown: Sequence[str] = field(default_factory=list)

    @property
    def times(self) -> list[float]:
        """201 instants from 0 on."""
        return [self.until_s * number / 200 for number in range(201)]


def problems() -> list[Problem]:
    """In the order of the page."""
    return [_oscillator(), _stiff(), _ball(), _prey(), _mass()]


def _oscillator() -> Problem:
    system = System({"x": 1.0, "v": 0.0}, {"x": "v", "v": "-x - 0.2*v"}, "QSS3", 1e-5)
    mode = Mode(lambda _t, y: [y[1], -y[0] - 0.2 * y[1]])
    return Problem("linear", system, {"": mode}, 10.0)


def _stiff() -> Problem:
    equations = {"x": "0.01*y", "y": "-100*x - 100*y + 2020"}
    system = System({"x": 0.0, "y": 20.0}, equations, "LIQSS2", 1e-2)
    mode = Mode(lambda _t, y: [0.01 * y[1], -100.0 * y[0] - 100.0 * y[1] + 2020.0])
    return Problem("stiff", system, {"": mode}, 500.0, peer_method="Radau")


def _ball() -> Problem:
    event = When("x crosses 0 falling", v="-0.8*v")
    system = System({"x": 1.0, "v": 0.0}, {"x": "v", "v": "-9.81"}, "QSS2", 1e-4, events=[event])
    mode = Mode(
        lambda _t, y: [y[1], -9.81],
        [lambda _t, y: y[0] if y[1] < 0.0 else 1.0],
        lambda _t, y: ("", [0.0, -0.8 * y[1]]),
    )
    return Problem("bouncing ball", system, {"": mode}, 3.0)


def _prey() -> Problem:
    equations = {"x": "0.1*x - 0.1*x*y", "y": "0.1*x*y - 0.1*y"}
    system = System({"x": 0.5, "y": 0.5}, equations, "QSS3", 1e-5)
    mode = Mode(lambda _t, y: [0.1 * y[0] - 0.1 * y[0] * y[1], 0.1 * y[0] * y[1] - 0.1 * y[1]])
    return Problem("Lotka-Volterra", system, {"": mode}, 300.0)


def _mass() -> Problem:
    system = System(
        states={"x": 0.0, "v": 0.0},
        discrete={"slides": 0},
        definitions={"force": "10*sin(2*t) - x"},
        equations={"x": "v", "v": "0 if slides == 0 else force - 4*slides - 0.1*v"},
        method="QSS3",
        quantum=1e-5,
        events=[
            When("force crosses 5 rising", only_if="slides == 0", slides=1),
            When("force crosses -5 falling", only_if="slides == 0", slides=-1),
            When(
                "slides*v crosses 0 falling",
                v=0,
                slides="0 if abs(force) <= 5 else sign(force)",
            ),
        ],
        outputs=["x", "v"],
    )
    return Problem("stick-slip", system, _mass_modes(), 20.0, start="stands")


def _force(t: float, y: Sequence[float]) -> float:
    return 10.0 * math.sin(2.0 * t) - y[0]


def _mass_modes() -> dict[str, Mode]:
    def slides(direction: int) -> Mode:
        return Mode(
            lambda t, y: [y[1], _force(t, y) - 4.0 * direction - 0.1 * y[1]],
            [lambda _t, y: direction * y[1]],
            stop,
        )

    def start(t: float, y: Sequence[float]) -> tuple[str, list[float]]:
        return ("forth" if _force(t, y) > 0.0 else "back"), [y[0], 0.0]

    def stop(t: float, y: Sequence[float]) -> tuple[str, list[float]]:
        return start(t, y) if abs(_force(t, y)) > 5.0 else ("stands", [y[0], 0.0])

    stands = Mode(lambda _t, _y: [0.0, 0.0], [lambda t, y: 5.0 - abs(_force(t, y))], start)
    return {"stands": stands, "forth": slides(1), "back": slides(-1)}
