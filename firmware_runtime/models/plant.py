"""Plants as a controller may state them: a state, and where a command takes it.

A state is a tuple: position and rate first, as a controller measures them, then whatever else the
model needs to go on, such as a motor that still spins up.
"""

import math
from collections.abc import Sequence
from typing import Protocol

from msgspec import Struct

from firmware_runtime.system.elementary import exp, expm1

State = tuple[float, ...]


class PlantModel(Protocol):
    """Model of a plant: where it begins, and where a constant command takes it."""

    @property
    def rest(self) -> State:
        """The state before any command."""
        ...

    def after(self, state: State, command: float, elapsed_s: float) -> State:
        """The state `elapsed_s` later, with the command held meanwhile."""
        ...


class SecondOrderPlant(Struct, frozen=True):
    """A body that a lagging actuator pushes or turns against viscous damping, in closed form.

        d(drive)/dt = (gain * command - drive) / lag,  d(rate)/dt = drive - damping * rate

    State: position, rate, drive; drive in units of position per s2. Raises ValueError with every
    number that is none of a plant.
    """

    gain: float
    """Acceleration per unit of command, without damping: 1/mass, or lever arm over inertia."""
    damping_per_s: float = 0.0
    """Viscous friction over mass or inertia."""
    lag_s: float = 0.0
    """Time constant of the actuator; 0 means at once."""

    def __post_init__(self) -> None:
        faults = [
            f"{name} is {value}, expected a finite number{expected}"
            for name, value, is_sound, expected in (
                ("gain", self.gain, self.gain != 0.0, " that is not 0"),
                ("damping_per_s", self.damping_per_s, self.damping_per_s >= 0.0, ", 0 or more"),
                ("lag_s", self.lag_s, self.lag_s >= 0.0, ", 0 or more"),
            )
            if not (is_sound and math.isfinite(value))
        ]
        if faults:
            raise ValueError(f"second-order plant: {'; '.join(faults)}")

    @property
    def rest(self) -> State:
        """At rest, and the actuator too."""
        return (0.0, 0.0, 0.0)

    def after(self, state: State, command: float, elapsed_s: float) -> State:
        """The state `elapsed_s` later, exactly."""
        position, rate, drive = state
        settled, damping = self.gain * command, self.damping_per_s
        coast = convolution(damping, 0.0, elapsed_s)
        gap = drive - settled if self.lag_s else 0.0
        moved = rate * coast + settled * ramp(damping, elapsed_s)
        gained = settled * coast
        if gap:
            fading = convolution(damping, 1.0 / self.lag_s, elapsed_s)
            moved += gap * (coast - fading) * self.lag_s
            gained += gap * fading
            gap *= exp(-elapsed_s / self.lag_s)
        return (
            position + moved,
            rate * exp(-damping * elapsed_s) + gained,
            settled + gap,
        )


def travelled(plant: PlantModel, state: State, commands: Sequence[tuple[float, float]]) -> State:
    """The state after commands that were held for so many seconds each, in order."""
    for command, elapsed_s in commands:
        state = plant.after(state, command, elapsed_s)
    return state


def convolution(a: float, b: float, t: float) -> float:
    """The integral of e^(-a (t - u)) e^(-b u) over u from 0 to t; a, b >= 0, equal or not."""
    apart = abs(a - b) * t
    mean = -expm1(-apart) / apart if apart else 1.0
    return t * mean * exp(-min(a, b) * t)


def ramp(a: float, t: float) -> float:
    """The integral of (1 - e^(-a u)) / a over u from 0 to t; half the square of t where a is 0."""
    z = a * t
    if z < 1e-3:
        return t * t * (1 / 2 - z * (1 / 6 - z * (1 / 24 - z / 120)))
    return (t - convolution(a, 0.0, t)) / a
