"""The vehicle as a DEVS model of quantized integrators, a simulator of its own.

The same motion as `arena_vehicle`: between two changes of the wheels both turn evenly, so the speed
and the rate of turning are input values that hold; place and heading are integrated. Contact is the
zero crossing of the distance to what stands about, and stops the vehicle for good. The polynomials
that have held are remembered, for sensors that ask late.
"""

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.qss import Segment, Simulation, System, When
from sim_doubles.worlds.arena_geometry import Circle, Shape
from sim_doubles.worlds.arena_parameters import ArenaParameters
from sim_doubles.worlds.arena_past import Past, require_in_order
from sim_doubles.worlds.arena_vehicle import Pose, WheelAngles, WheelsChangeAt, gears

__all__ = ["QUANTUM", "QuantizedVehicle"]

QUANTUM: Final = 1e-5
"""Quantum of x and y in m, of the heading in rad."""

_SHORTEST: Final = 1000
"""From a shorter time, in ns, no speed can be computed."""


class _Stretch(NamedTuple):
    """A polynomial of place or heading, and since when it has held."""

    since: int
    segment: Segment

    def at(self, at: int) -> float:
        return self.segment.at((at - self.since) / SECOND)


class QuantizedVehicle:
    """Stands at its start at instant 0; instants are ns."""

    def __init__(
        self,
        parameters: ArenaParameters,
        wheel_angles: WheelAngles,
        wheels_change_at: WheelsChangeAt,
    ) -> None:
        self._track_m = parameters.track_width_m
        self._gears = gears(parameters)
        self._wheel_angles, self._wheels_change_at = wheel_angles, wheels_change_at
        self._simulation = Simulation(_system(parameters))
        self._pasts = [self._past(name) for name in ("x", "y", "heading")]
        # The even motion under way
        self._since = 0
        self._angles = wheel_angles(0)
        self._has_speed = False

    @property
    def collided(self) -> bool:
        """Return whether it has touched anything, up to the latest instant read."""
        return self._simulation.model.engine.signals["touched"].coefficients[0] > 0.0

    def pose(self, at: int) -> Pose:
        """Return its pose at an instant, now or before."""
        self._go_on(at)
        return Pose(*(past.at(at).at(at) for past in self._pasts))

    def advance(self, at: int) -> None:
        """Begin another even motion at an instant. Raises ValueError if the last began later."""
        require_in_order(at, self._since)
        self._go_on(at)
        self._end(at)

    def push(self, at: int, turn_rad: float) -> None:
        """Turn it where it stands, at once."""
        self.advance(at)
        simulation = self._simulation
        simulation.advance(max(at, simulation.now))
        self._tell("push", turn_rad)
        self._tell("push", 0.0)

    def hold(self, at: int, *, is_held: bool) -> None:
        """Keep it where it stands, its treads slipping, or let go of it."""
        self.advance(at)
        self._simulation.advance(max(at, self._simulation.now))
        self._tell("held", float(is_held))

    def _tell(self, port: str, value: float) -> None:
        simulation = self._simulation
        simulation.simulator.inject(simulation.model.in_ports[port], Segment(value))
        simulation.simulator.advance(simulation.now)

    def _go_on(self, at: int) -> None:
        if at < self._since:
            return
        while (change_at := self._wheels_change_at(self._since)) <= at:
            self._end(change_at)
        self._run(at)

    def _end(self, at: int) -> None:
        """Come to the end of an even motion."""
        self._run(at)
        self._since, self._angles, self._has_speed = at, self._wheel_angles(at), False

    def _run(self, at: int) -> None:
        if not self._has_speed:
            if at - self._since < _SHORTEST:
                return
            self._set_speeds(at)
        self._simulation.advance(max(at, self._simulation.now))

    def _set_speeds(self, at: int) -> None:
        """From how far the wheels have turned since they changed."""
        elapsed_s = (at - self._since) / SECOND
        angles = zip(self._wheel_angles(at), self._angles, self._gears, strict=True)
        right, left = ((now - then) * gear / elapsed_s for now, then, gear in angles)
        simulation, ports = self._simulation, self._simulation.model.in_ports
        simulation.advance(max(self._since, simulation.now))
        simulation.simulator.inject(ports["speed"], Segment(0.5 * (right + left)))
        simulation.simulator.inject(ports["turning"], Segment((right - left) / self._track_m))
        simulation.simulator.advance(simulation.now)
        self._has_speed = True

    def _past(self, name: str) -> Past[_Stretch]:
        past: Past[_Stretch] = Past()
        model = self._simulation.model
        self._simulation.simulator.listen(
            model.exact(name), lambda at, segment: past.add(_Stretch(at, segment))
        )
        past.add(_Stretch(0, model.states[name].exact.segment_at(0)))
        return past


def _system(parameters: ArenaParameters) -> System:
    x_m, y_m = parameters.start
    return System(
        states={
            "x": x_m,
            "y": y_m,
            "heading": math.radians(90.0 - parameters.start_bearing_deg),
        },
        equations={
            "x": "0 if touched or held else speed * cos(heading)",
            "y": "0 if touched or held else speed * sin(heading)",
            "heading": "0 if touched or held else turning",
        },
        method="QSS2",
        quantum=QUANTUM,
        discrete={"speed": 0.0, "turning": 0.0, "touched": 0.0, "push": 0.0, "held": 0.0},
        events=[*_contacts(parameters), _PUSH],
        name="vehicle",
    )


_PUSH: Final = When("abs(push) crosses 1e-9 rising", heading="heading + push")


def _contacts(parameters: ArenaParameters) -> Iterator[When]:
    for shape in parameters.shapes:
        square, least = _distance(shape, parameters.body_radius_m)
        yield When(f"{square} crosses {least * least!r} falling", touched=1)


def _distance(shape: Shape, body_m: float) -> tuple[str, float]:
    """The square of the centre's distance to a shape, and how small the distance may become."""
    if isinstance(shape, Circle):
        square = f"(x - ({shape.x_m!r})) ** 2 + (y - ({shape.y_m!r})) ** 2"
        return square, shape.radius_m + body_m
    dx, dy = shape.x2_m - shape.x1_m, shape.y2_m - shape.y1_m
    from_x, from_y = f"(x - ({shape.x1_m!r}))", f"(y - ({shape.y1_m!r}))"
    foot = f"({from_x} * ({dx!r}) + {from_y} * ({dy!r})) / {dx * dx + dy * dy!r}"
    share = f"min(max({foot}, 0), 1)"
    square = f"({from_x} - {share} * ({dx!r})) ** 2 + ({from_y} - {share} * ({dy!r})) ** 2"
    return square, body_m
