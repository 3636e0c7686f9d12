"""Random plants, what pushes them, and what is measured of them: all of a seed.

The plant is TachoBot's world on its platform, which finds sticking and slipping by formulas of its
own and shares no line with what identifies it. Motors stand still at first, so it spins up
undriven for a second that nothing is recorded of.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from firmware_runtime.devs.time import seconds
from firmware_runtime.lab.identification.plant import Numbers, PlantParameters
from firmware_runtime.lab.identification.recorded_series import Quantity, Series
from sim_doubles.worlds.tachobot import TachobotWorld
from tests.support.pushed_body import LEVER_ARM_M, PAIR_N, parameters_of

LAG_S: Final = 0.03
PERIOD_S: Final = 0.01
FOR_S: Final = 24.0
_SLOW_S: Final = 12.0
_SPIN_UP_S: Final = 1.0


@dataclass(frozen=True, slots=True)
class Drawn:
    """A plant and one recording of it."""

    plant: PlantParameters
    series: Series
    correlation: float
    """Of the noise from one measurement to the next."""


def drawn(seed: int, quantity: Quantity) -> Drawn:
    """The plant of a seed, and what was measured."""
    random = np.random.default_rng(seed)
    plant = _plant(random)
    at = np.arange(round(FOR_S / PERIOD_S)) * PERIOD_S
    given = _pushed(random, plant, at)
    truth = _moved(plant, at, given, quantity)
    share, correlation = random.uniform(0.005, 0.03), float(random.choice([0.0, 0.3, 0.7]))
    noise = share * float(np.std(truth)) * _noise(random, len(at), correlation)
    offset = 0.01
    return Drawn(plant, Series(at, given, at, truth + noise + offset, quantity), correlation)


def _plant(random: np.random.Generator) -> PlantParameters:
    """Inertia over a decade, damped in 0.5 to 3 s, friction of 0.3 to 1 rad/s2 and above."""
    inertia = math.exp(random.uniform(math.log(0.03), math.log(0.3)))
    damping = inertia / math.exp(random.uniform(math.log(0.5), math.log(3.0)))
    coulomb = inertia * random.uniform(0.3, 1.0)
    static = coulomb * random.uniform(1.2, 2.0)
    return PlantParameters(inertia, damping, coulomb, static, random.uniform(0.005, 0.12))


def _pushed(random: np.random.Generator, plant: PlantParameters, at: Numbers) -> Numbers:
    """Slow waves that it breaks away in, then a square wave of random lengths and heights."""
    slow = at < _SLOW_S
    waves = 2.2 * plant.static * (0.8 + 0.05 * at) * np.sin(math.tau * at / 4.0)
    given = np.where(slow, waves, 0.0)
    place, sign, most = int(slow.sum()), 1.0, 4.0 * plant.inertia + 2.0 * plant.static
    while place < len(at):
        length = round(random.uniform(0.3, 1.2) / PERIOD_S)
        given[place : place + length] = sign * most * random.uniform(0.5, 1.0)
        place, sign = place + length, -sign
    return given


def _noise(random: np.random.Generator, count: int, correlation: float) -> Numbers:
    """Of variance 1, and settled."""
    white = random.normal(0.0, 1.0, count + 200)
    noise = np.zeros(len(white))
    for place in range(1, len(white)):
        noise[place] = correlation * noise[place - 1] + white[place]
    settled: Numbers = math.sqrt(1.0 - correlation**2) * noise[200:]
    return settled


def _moved(plant: PlantParameters, at: Numbers, given: Numbers, quantity: Quantity) -> Numbers:
    """The rate or position at these instants, of a world that is pushed a delay later."""
    duties = [0.5] * 8
    world = TachobotWorld(parameters_of(plant, LAG_S), lambda: tuple(duties))
    pushes = [(seconds(_SPIN_UP_S + t + plant.delay_s), u) for t, u in zip(at, given, strict=True)]
    looks = [(seconds(_SPIN_UP_S + t), None) for t in at]
    found: list[float] = []
    for instant, push in sorted([*pushes, *looks], key=lambda event: (event[0], event[1] is None)):
        if push is None:
            state = world.state(instant)
            found.append(state.yaw_rate_rad_s if quantity == "rate" else state.yaw_rad)
        else:
            world.advance(instant)
            half = 0.5 * push / (4.0 * PAIR_N * LEVER_ARM_M)
            duties[:] = [0.5 + half, 0.5 - half, 0.5 - half, 0.5 + half] * 2
    return np.array(found)
