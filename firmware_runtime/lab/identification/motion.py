"""Motion of a body with friction under a drive: whole stretches at once, events one by one.

While it slides one way the motion is linear, so a piece of many stretches is one running sum. Where
the rate reaches zero the instant is found within its stretch; there the body sticks, or turns back
if the drive exceeds static friction. A body that sticks breaks away at the instant at which the
drive does.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import brentq

from firmware_runtime.lab.identification.plant import Numbers, PlantParameters
from firmware_runtime.lab.identification.stretches import (
    Stretches,
    convolution,
    convolutions,
    followed,
    pieces,
    ramp,
    ramps,
)

_INSTANT_S: Final = 1e-9
"""The least that time goes on between two events."""


@dataclass(slots=True)
class State:
    """Place of a body within a stretch, and the way in which it slides."""

    node: int
    since: float
    """Seconds into the stretch after the node."""
    position: float
    rate: float
    direction: int
    """The sense in which it slides; 0 while it sticks."""


def motion(plant: PlantParameters, cut: Stretches, rate: float) -> tuple[Numbers, Numbers]:
    """Position and rate at every measurement, from position 0 and this rate at the first."""
    body = Body(plant, cut)
    body.run(rate)
    return body.position[cut.measured], body.rate[cut.measured]


class Body:
    """One simulated run; `position` and `rate` at the nodes."""

    def __init__(self, plant: PlantParameters, cut: Stretches) -> None:
        self.position = np.zeros(len(cut.spans) + 1)
        self.rate = np.zeros(len(cut.spans) + 1)
        self._cut = cut
        self._static = max(plant.static, plant.coulomb)
        self._held = plant.coulomb / plant.inertia
        self._inertia = plant.inertia
        self._damping = damping = plant.damping / plant.inertia
        spans = cut.spans
        self._decays = damping * spans
        self._coast = convolutions(damping, 0.0, spans)
        self._ramp = ramps(damping, spans)
        pushed = cut.given / plant.inertia
        self._gained, self._moved = pushed * self._coast, pushed * self._ramp
        if cut.lag_s:
            gap = (cut.drive[:-1] - cut.given) / plant.inertia
            fading = convolutions(damping, 1.0 / cut.lag_s, spans)
            self._gained = self._gained + gap * fading
            self._moved = self._moved + gap * (self._coast - fading) * cut.lag_s
            self._exceeds = np.abs(cut.drive[1:]) > self._static
        else:
            self._exceeds = np.abs(cut.given) > self._static

    def run(self, rate: float) -> None:
        """Move from the first measurement to the last, from this rate on."""
        cut = self._cut
        is_free = self._static == 0.0
        direction = (1 if rate > 0 else -1) if rate else int(is_free)
        state = State(cut.begin, 0.0, 0.0, rate, direction)
        self.rate[cut.begin] = rate
        while state.node < len(cut.spans):
            if state.direction == 0:
                self._stick(state)
            elif state.since:
                self._slide_within(state)
            else:
                self._slide(state, may_stop=not is_free)

    def _slide(self, state: State, *, may_stop: bool) -> None:
        """Slide over as many whole stretches as there are until the rate changes its sign."""
        friction = state.direction * self._held
        begin, end = next(pieces(self._decays, state.node))
        piece = slice(begin, end)
        gained = self._gained[piece] - friction * self._coast[piece]
        rates = followed(state.rate, self._decays[piece], gained)
        count = end - begin
        if may_stop:
            stops = state.direction * rates < 0.0
            first = int(stops.argmax())
            count = first if stops[first] else count
        if count:
            self._take(state, begin, rates[:count], friction)
        if count < end - begin:
            self._slide_within(state)

    def _take(self, state: State, begin: int, rates: Numbers, friction: float) -> None:
        """Go on over the stretches at whose ends these are the rates."""
        end = begin + len(rates)
        before = np.concatenate(([state.rate], rates[:-1]))
        moved = before * self._coast[begin:end] + self._moved[begin:end]
        moved -= friction * self._ramp[begin:end]
        self.rate[begin + 1 : end + 1] = rates
        self.position[begin + 1 : end + 1] = state.position + np.cumsum(moved)
        state.node, state.rate = end, float(rates[-1])
        state.position = float(self.position[end])

    def _slide_within(self, state: State) -> None:
        """Slide to the end of this stretch, or to where the body comes to rest in it."""
        left = float(self._cut.spans[state.node]) - state.since
        position, rate = self._after(state, left)
        if state.direction * rate >= 0.0:
            self._end(state, position, rate)
            return
        stop = self._stop(state, left)
        if stop == 0.0 and state.rate == 0.0:  # it broke away by no more than rounding
            state.direction = 0
            self._end(state, state.position, 0.0)
            return
        state.position, _ = self._after(state, stop)
        state.rate, state.direction = 0.0, 0
        state.since += max(stop, _INSTANT_S)
        if state.since >= self._cut.spans[state.node]:
            self._end(state, state.position, 0.0)

    def _stop(self, state: State, left: float) -> float:
        """Find when the rate is zero within `left` s; 0 for what broke away by rounding alone."""
        low = 0.0 if state.rate else self._gone(state, left)
        if low == 0.0 and state.rate == 0.0:
            return 0.0
        stop: float = brentq(lambda at: self._after(state, at)[1], low, left, xtol=_INSTANT_S)
        return stop

    def _gone(self, state: State, left: float) -> float:
        """A time within `left` s at which what broke away moves its way; 0 if it never does."""
        at = left
        while at > _INSTANT_S:
            at *= 0.5
            if state.direction * self._after(state, at)[1] > 0.0:
                return at
        return 0.0

    def _stick(self, state: State) -> None:
        """Hold until the drive exceeds static friction."""
        if self._breaks(state):
            return
        following = state.node + 1 if state.since else state.node
        exceeds = self._exceeds[following:]
        first = int(exceeds.argmax()) if exceeds.any() else len(exceeds)
        state.node, before = following + first, state.node
        self.position[before + 1 : state.node + 1] = state.position
        state.since = 0.0
        if first < len(exceeds) and not self._breaks(state):
            self._end(state, state.position, 0.0)

    def _breaks(self, state: State) -> bool:
        """Break away in what is left of this stretch, if the drive exceeds the friction there."""
        drive, settled = self._drive(state), float(self._cut.given[state.node])
        if abs(drive) <= self._static:
            if not (self._cut.lag_s and abs(settled) > self._static):
                return False
            gap = settled - math.copysign(self._static, settled)
            since = state.since + self._cut.lag_s * math.log((settled - drive) / gap)
            if since >= self._cut.spans[state.node]:
                return False
            state.since, drive = since, settled
        state.direction = 1 if drive > 0 else -1
        return True

    def _end(self, state: State, position: float, rate: float) -> None:
        state.node += 1
        state.since, state.position, state.rate = 0.0, position, rate
        self.position[state.node], self.rate[state.node] = position, rate

    def _drive(self, state: State) -> float:
        given = float(self._cut.given[state.node])
        if not self._cut.lag_s:
            return given
        gap = float(self._cut.drive[state.node]) - given
        return given + gap * math.exp(-state.since / self._cut.lag_s)

    def _after(self, state: State, elapsed: float) -> tuple[float, float]:
        """Position and rate so much later in the same stretch."""
        damping, lag_s = self._damping, self._cut.lag_s
        given = float(self._cut.given[state.node])
        push = given / self._inertia - state.direction * self._held
        coast = convolution(damping, 0.0, elapsed)
        position = state.position + state.rate * coast + push * ramp(damping, elapsed)
        rate = state.rate * math.exp(-damping * elapsed) + push * coast
        if lag_s:
            gap = (self._drive(state) - given) / self._inertia
            fading = convolution(damping, 1.0 / lag_s, elapsed)
            position += gap * (coast - fading) * lag_s
            rate += gap * fading
        return position, rate
