"""A PID loop around an identified plant, tick by tick: saturation, friction, delay, noise and all.

The controller is `models.pid`, line by line; the plant moves in closed form between ticks. Within a
tick it stops at most once: what that costs in position is of the order of a tick's travel at rest.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from firmware_runtime.lab.identification.plant import PlantParameters
from firmware_runtime.lab.tuning.loop import Gains
from firmware_runtime.models.plant import convolution, ramp

EFFORT_S: Final = 0.1
"""Cost of a second of full command, beside the ITAE of the step."""


@dataclass(frozen=True, slots=True)
class Body:
    """Body that the controller moves, and its actuator; SI."""

    plant: PlantParameters
    """Its delay is all of the loop's."""
    lag_s: float
    gain: float
    """Force or moment per unit of command."""
    limit: float
    """Limit of the command."""
    period_s: float


@dataclass(frozen=True, slots=True)
class Scenario:
    """A step of the reference at 0, noise on the measured rate, and a push from half time on."""

    step: float
    for_s: float
    noise: Sequence[float]
    """A value a tick."""
    push: float = 0.0
    """Force or moment."""


@dataclass(frozen=True, slots=True)
class Stepped:
    """Response to a scenario, a value a tick."""

    positions: list[float]
    commands: list[float]
    cost: float


def cost_of(body: Body, gains: Gains, scenario: Scenario) -> float:
    """The integral of time and error, as a share of the step, and what the effort costs: s2."""
    return stepped(body, gains, scenario).cost


def stepped(body: Body, gains: Gains, scenario: Scenario) -> Stepped:
    """Run a scenario."""
    period, step, limit = body.period_s, scenario.step, body.limit
    whole, rest = divmod(body.plant.delay_s / period, 1.0)
    late = [_Piece(body, rest * period), _Piece(body, (1.0 - rest) * period)]
    ticks = round(scenario.for_s / period)
    forces = [0.0] * (int(whole) + 2)
    state = (0.0, 0.0, 0.0, 0)
    integral = cost = 0.0
    positions, commands = [], []
    for tick in range(ticks):
        position, rate = state[0], state[1] + scenario.noise[tick]
        error = step - position
        grown = integral + gains.ki * error * period
        wanted = gains.kp * error + grown - gains.kd * rate
        command = max(-limit, min(limit, wanted))
        if command == wanted or (wanted - command) * error <= 0.0:
            integral = grown
        positions.append(position)
        commands.append(command)
        cost += tick * period * abs(error / step) + EFFORT_S * (command / limit) ** 2
        forces.append(body.gain * command)
        push = scenario.push if 2 * tick >= ticks else 0.0
        before = forces[-int(whole) - 2]
        after = forces[-int(whole) - 1]
        state = late[0].moved(state, before, push)
        state = late[1].moved(state, after, push)
    return Stepped(positions, commands, cost * period)


class _Piece:
    """A stretch of one length, with what it does to a body worked out."""

    def __init__(self, body: Body, span_s: float) -> None:
        plant, lag_s = body.plant, body.lag_s
        damping = plant.damping / plant.inertia
        self._span_s = span_s
        self._kept = math.exp(-damping * span_s)
        self._coast = convolution(damping, 0.0, span_s)
        self._ramp = ramp(damping, span_s)
        fading = convolution(damping, 1.0 / lag_s, span_s) if lag_s else 0.0
        self._fading, self._faded = fading, (self._coast - fading) * lag_s
        self._lagged = math.exp(-span_s / lag_s) if lag_s else 0.0
        self._inertia, self._coulomb = plant.inertia, plant.coulomb
        self._static = max(plant.static, plant.coulomb)

    def moved(
        self, state: tuple[float, float, float, int], given: float, push: float
    ) -> tuple[float, float, float, int]:
        """Position, rate, drive and sense of motion after it; a push acts without lag."""
        position, rate, drive, sense = state
        gap = drive - given
        after = given + gap * self._lagged
        if sense == 0:
            if abs(drive + push) <= self._static and abs(after + push) <= self._static:
                return position, 0.0, after, 0
            sense = 1 if after + push > 0.0 else -1
        pushed = (given + push - sense * self._coulomb) / self._inertia
        gap /= self._inertia
        end = rate * self._kept + pushed * self._coast + gap * self._fading
        if end * sense < 0.0 and self._static > 0.0:
            share = rate / (rate - end) if rate != end else 0.0
            return position + 0.5 * rate * self._span_s * share, 0.0, after, 0
        moved = rate * self._coast + pushed * self._ramp + gap * self._faded
        return position + moved, end, after, sense
