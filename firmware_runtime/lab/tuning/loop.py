"""A PID loop around a body behind a delay, as a frequency sees it, with a Smith predictor or not.

The loop is cut at the actuators' input. What a controller sends once a period is held until the
next: that hold is in the response, friction that is not viscous is not.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from firmware_runtime.models.plant import SecondOrderPlant, State

Frequencies: TypeAlias = NDArray[np.floating[Any]]
Response: TypeAlias = NDArray[np.complexfloating[Any, Any]]

_LOWEST: Final = 1e-6
"""rad/s, at which any loop is large."""
_NODES: Final = 64
"""Nodes of the integral over a predictor's delay: enough for ten of a frequency's cycles."""


@dataclass(frozen=True, slots=True)
class Gains:
    """Gains of `models.pid`: on the error, on its integral, on the measured rate."""

    kp: float
    ki: float
    kd: float


@dataclass(frozen=True, slots=True)
class Predictor:
    """Plant and delay as a Smith predictor takes them to be, begun from the measurement."""

    plant: SecondOrderPlant
    delay_s: float


@dataclass(frozen=True, slots=True)
class Loop:
    """The plant from a command to a position, and everything that is late in the loop."""

    plant: SecondOrderPlant
    delay_s: float
    period_s: float

    def open(
        self, gains: Gains, frequencies: Frequencies, predictor: Predictor | None = None
    ) -> Response:
        """The open loop at these frequencies, rad/s."""
        s = 1j * frequencies
        held = -np.expm1(-s * self.period_s) / (s * self.period_s)
        position = held * np.exp(-s * self.delay_s) * _plant(self.plant, s)
        on_position = gains.kp + gains.ki / s
        if predictor is None:
            found: Response = (on_position + gains.kd * s) * position
            return found
        return _predicted(gains, predictor, s, held, position)


def _plant(plant: SecondOrderPlant, s: Response) -> Response:
    found: Response = plant.gain / (s * (s + plant.damping_per_s) * (plant.lag_s * s + 1.0))
    return found


def _predicted(
    gains: Gains, predictor: Predictor, s: Response, held: Response, position: Response
) -> Response:
    """The open loop with what the predictor makes of commands that are still under way.

    predicted = travel of what is measured + travel of the drive of a delay ago + what the commands
    of the delay do, each a position and a rate.
    """
    plant, delay_s = predictor.plant, predictor.delay_s
    on_position = gains.kp + gains.ki / s
    of_position, of_rate, of_drive = (
        _travelled(plant, state, delay_s) for state in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))
    )

    def commanded(place: State) -> Response:
        wanted: Response = on_position * place[0] + gains.kd * place[1]
        return wanted

    drive = held * np.exp(-s * delay_s) * plant.gain / (plant.lag_s * s + 1.0)
    within = commanded(of_drive) * drive if plant.lag_s else np.zeros_like(s)
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    pushed = (0.0, 0.0, plant.gain / plant.lag_s) if plant.lag_s else (0.0, plant.gain, 0.0)
    for node, weight in zip(0.5 * delay_s * (nodes + 1.0), 0.5 * delay_s * weights, strict=True):
        reached = _travelled(plant, pushed, float(node))
        within = within + weight * held * np.exp(-s * node) * commanded(reached)
    measured = commanded(of_position) * position + commanded(of_rate) * s * position
    found: Response = measured / (1.0 + within)
    return found


def _travelled(plant: SecondOrderPlant, state: State, elapsed_s: float) -> State:
    return plant.after(state, 0.0, elapsed_s) if elapsed_s else state


@dataclass(frozen=True, slots=True)
class Margins:
    """Margins of a loop from the edge; infinite where nothing of its kind leads there.

    Of an unstable loop gain and phase are below 0, and there is no delay left.
    """

    gain_db: float
    """The least change of gain, up or down, that makes it unstable."""
    phase_deg: float
    crossover_rad_s: float
    """The frequency of the phase margin."""
    delay_s: float
    """The least delay more that makes it unstable."""

    @property
    def is_stable(self) -> bool:
        """Return whether the loop is stable as it is."""
        return self.phase_deg > 0.0


def margins(loop: Loop, gains: Gains, predictor: Predictor | None = None) -> Margins:
    """Compute the margins of the open loop, up to the frequency that half a period has."""
    frequencies = np.geomspace(1e-2, math.pi / loop.period_s, 1500)
    response = loop.open(gains, frequencies, predictor)
    size, phase = np.log(np.abs(response)), np.unwrap(np.angle(response))
    ones = _crossings(size, np.zeros_like(size))
    turns = np.round((phase.min() / math.pi - 1.0) / 2.0), np.round((phase.max() / math.pi) / 2.0)
    halves = [math.pi * (2.0 * k - 1.0) for k in np.arange(turns[0] - 1, turns[1] + 2)]
    edges = [place for half in halves for place in _crossings(phase, np.full_like(phase, half))]
    gain_db = min((abs(_at(size, each)) for each in edges), default=math.inf)
    phases = [(math.remainder(_at(phase, each) - math.pi, math.tau), each) for each in ones]
    least, place = min(phases, key=lambda each: abs(each[0]), default=(math.inf, 0.0))
    crossover = _at(frequencies, place) if phases else math.nan
    delays = [(turned % math.tau) / _at(frequencies, each) for turned, each in phases]
    found = Margins(
        gain_db=20.0 / math.log(10.0) * gain_db,
        phase_deg=math.degrees(least),
        crossover_rad_s=crossover,
        delay_s=min(delays, default=math.inf),
    )
    low = loop.open(gains, np.geomspace(_LOWEST, frequencies[0], 300, endpoint=False), predictor)
    return found if _is_stable(np.concatenate((low, response))) else _of_unstable(found)


def _is_stable(response: Response) -> bool:
    """By Nyquist's criterion, of an open loop with poles at 0 and left of it alone.

    From its lowest frequency on, where the loop is large, 1 + L turns by what its poles at 0 had
    turned it back, and ends at 1.
    """
    turned = np.unwrap(np.angle(1.0 + response))
    begin = float(np.angle(response[0]))
    begin -= math.tau if begin > 0.0 else 0.0  # three poles at 0 at most, and a PID that leads
    whole = math.tau * round((begin - turned[0]) / math.tau)
    return bool(abs(turned[-1] + whole) < math.pi)


def _of_unstable(found: Margins) -> Margins:
    phase = found.phase_deg
    return replace(
        found,
        gain_db=-found.gain_db,
        phase_deg=phase - 360.0 if phase > 0.0 else phase,
        delay_s=0.0,
    )


def _crossings(values: Frequencies, level: Frequencies) -> list[float]:
    """Find where values pass a level: a place between two samples, as a fraction of the index."""
    apart = values - level
    before = np.flatnonzero(np.signbit(apart[1:]) != np.signbit(apart[:-1]))
    return [float(k + apart[k] / (apart[k] - apart[k + 1])) for k in before]


def _at(values: Frequencies, place: float) -> float:
    return float(np.interp(place, np.arange(len(values)), values))
