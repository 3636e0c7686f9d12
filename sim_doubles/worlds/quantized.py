"""TachoBot's body and motors as a DEVS model of quantized integrators, a simulator of its own.

The same equations as the closed forms (`propellers`, `turntable`, `hovering`), written down as
such: eight motors with their lag, the moments, and the bearing's friction by zero crossings. It
sticks where the rate reaches zero and breaks away where the moment reaches static friction, each at
the instant of the crossing. Duties are input values of the model.
"""

from collections.abc import Callable, Iterator
from typing import Final, Literal

from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.qss import Segment, Simulation, System, When
from sim_doubles.worlds.propellers import MOTORS, PropellerPairs
from sim_doubles.worlds.tachobot_body import TachobotParameters, TachobotState

__all__ = ["QUANTA", "QuantizedBody", "QuantizedSolver"]

QuantizedSolver = Literal["qss2", "qss3"]

QUANTA: Final = {
    **{f"motor{number}": 1e-5 for number in range(MOTORS)},
    "yaw": 1e-5,
    "rate": 1e-5,
    **dict.fromkeys(("x", "y", "vx", "vy"), 1e-5),
}
"""Shares of full speed, rad, rad/s, m and m/s: far below what the sensors tell apart."""

_PAIRS: Final = {
    f"f{pair + 1}": f"thrust * (motor{2 * pair} ** 2 - motor{2 * pair + 1} ** 2)"
    for pair in range(4)
}
_FORCES: Final = {
    **_PAIRS,
    "forward": "f1 - f3",
    "left": "f4 - f2",
    "moment": "arm * (f1 - f2 + f3 - f4)",
}
_PLACE: Final = {
    "x": "vx",
    "y": "vy",
    "vx": "0 if held else (forward * cos(yaw) - left * sin(yaw)) / mass",
    "vy": "0 if held else (forward * sin(yaw) + left * cos(yaw)) / mass",
}


class QuantizedBody:
    """TachoBot at rest at first, on its platform or free, advanced from one instant to another."""

    def __init__(self, parameters: TachobotParameters, solver: QuantizedSolver) -> None:
        self._is_free = parameters.mounting == "free"
        self._is_held = False
        self._mass = parameters.mass_kg
        self._simulation = Simulation(_system(parameters, solver))
        prefix = "duty" if parameters.motor_lag_s > 0.0 else "motor"
        ports = self._simulation.model.in_ports
        self._ports = [ports[f"{prefix}{number}"] for number in range(MOTORS)]
        self._duties = [0.0] * MOTORS
        self._values = self._simulation.values

    @property
    def turn(self) -> tuple[float, float]:
        """Yaw and its rate."""
        return self._values["yaw"], self._values["rate"]

    @property
    def state(self) -> TachobotState:
        """Return its state now."""
        values = self._values
        if not self._is_free:
            return TachobotState(0.0, 0.0, 0.0, 0.0, *self.turn)
        x, vx, y, vy = (values[name] for name in ("x", "vx", "y", "vy"))
        return TachobotState(x, vx, y, vy, *self.turn)

    def acceleration(self, driven: Callable[[], PropellerPairs]) -> tuple[float, float]:
        """Forward and left, in m/s2, now; on the platform the centre is pinned."""
        if not self._is_free or self._is_held:
            return (0.0, 0.0)
        now = driven()
        return (now.forward().now() / self._mass, now.left().now() / self._mass)

    def push(self, rate_rad_s: float) -> None:
        """Change the yaw rate by so much, at once; a bearing that stuck slides."""
        self._tell("push", rate_rad_s)
        self._tell("push", 0.0)

    def hold(self, *, is_held: bool) -> None:
        """Keep it where it is, at rest, or let go of it: its bearing sticks."""
        self._is_held = is_held
        self._tell("held", float(is_held))

    def _tell(self, port: str, value: float) -> None:
        simulation = self._simulation
        simulation.simulator.inject(simulation.model.in_ports[port], Segment(value))
        simulation.simulator.advance(simulation.now)
        self._values = simulation.values

    def advance(self, propellers: PropellerPairs, elapsed_s: float) -> None:
        """Move for `elapsed_s` with the duties that these hold."""
        simulation, simulator = self._simulation, self._simulation.simulator
        now = simulation.now
        if propellers.duties != self._duties:
            for number, duty in enumerate(propellers.duties):
                if duty != self._duties[number]:
                    simulator.inject(self._ports[number], Segment(duty))
            self._duties = list(propellers.duties)
            simulator.advance(now)
        propellers.advance(elapsed_s)
        simulation.advance(now + round(elapsed_s * SECOND))
        self._values = simulation.values


def _system(parameters: TachobotParameters, solver: QuantizedSolver) -> System:
    motors = [f"motor{number}" for number in range(MOTORS)]
    lags, is_free = parameters.motor_lag_s > 0.0, parameters.mounting == "free"
    is_dry = not is_free and parameters.static_friction_nm > 0.0
    equations = {"yaw": "rate", "rate": _turning(is_free=is_free, is_dry=is_dry)}
    equations |= _PLACE if is_free else {}
    if lags:
        equations |= {motor: f"(duty{index} - {motor}) / lag" for index, motor in enumerate(motors)}
    driven = [f"duty{number}" for number in range(MOTORS)] if lags else motors
    return System(
        states=dict.fromkeys(equations, 0.0),
        equations=equations,
        method=solver.upper(),
        quantum={name: QUANTA[name] for name in equations},
        discrete={
            **dict.fromkeys(driven, 0.0),
            "push": 0.0,
            "held": 0.0,
            **({"direction": 0.0} if is_dry else {}),
        },
        definitions=_FORCES,
        parameters=dict(_numbers(parameters)),
        events=(*_BEARING, _PUSH_OFF, _HELD_FAST, _LET_GO)
        if is_dry
        else (_PUSH, _hold(is_free=is_free)),
        name="plant",
    )


def _turning(*, is_free: bool, is_dry: bool) -> str:
    if is_free:
        return "0 if held else moment / inertia"
    sliding = "(moment - damping * rate) / inertia"
    if not is_dry:
        return f"0 if held else {sliding}"
    return f"0 if held or direction == 0 else {sliding} - coulomb * direction / inertia"


_PUSHED: Final = "abs(push) crosses 1e-9 rising"
_PUSH: Final = When(_PUSHED, rate="rate + push")
_PUSH_OFF: Final = When(_PUSHED, rate="rate + push", direction="sign(rate + push)")
_HELD: Final = "held crosses 0.5 rising"
_ROLLS: Final = "0 if abs(moment) <= static else sign(moment)"
_HELD_FAST: Final = When(_HELD, rate=0, direction=0)
_LET_GO: Final = When("held crosses 0.5 falling", direction=_ROLLS)
_BEARING: Final = (
    When("moment crosses static rising", only_if="direction == 0", direction=1),
    When("moment crosses -static falling", only_if="direction == 0", direction=-1),
    When(
        "direction * rate crosses 0 falling",
        rate=0,
        direction=_ROLLS,
    ),
)


def _hold(*, is_free: bool) -> When:
    return When(_HELD, rate=0, vx=0, vy=0) if is_free else When(_HELD, rate=0)


def _numbers(parameters: TachobotParameters) -> Iterator[tuple[str, float]]:
    yield "thrust", parameters.pair_thrust_n
    yield "arm", parameters.lever_arm_m
    yield "inertia", parameters.yaw_inertia_kg_m2
    yield "mass", parameters.mass_kg
    yield "lag", parameters.motor_lag_s
    yield "damping", parameters.yaw_damping_nms
    yield "static", parameters.static_friction_nm
    yield "coulomb", parameters.coulomb_friction_nm
