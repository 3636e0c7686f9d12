"""A body with friction that is pushed as a table says, by TachoBot's world: the truth for tests."""

import numpy as np

from firmware_runtime.devs.time import seconds
from firmware_runtime.lab.identification.plant import Numbers, PlantParameters
from sim_doubles.worlds.tachobot import TachobotWorld
from sim_doubles.worlds.tachobot_body import TachobotParameters

LEVER_ARM_M, PAIR_N, _SPIN_UP_S = 0.2, 10.0, 1.0


def parameters_of(plant: PlantParameters, lag_s: float) -> TachobotParameters:
    """TachoBot's body with this inertia and this friction, and motors that lag so much."""
    return TachobotParameters(
        lever_arm_m=LEVER_ARM_M,
        yaw_inertia_kg_m2=plant.inertia,
        pair_thrust_n=PAIR_N,
        motor_lag_s=lag_s,
        yaw_damping_nms=plant.damping,
        static_friction_nm=plant.static,
        coulomb_friction_nm=plant.coulomb,
    )


def pushed_body(
    plant: PlantParameters, lag_s: float, at: Numbers, given: Numbers
) -> tuple[Numbers, Numbers]:
    """Position and rate at these instants, with the moments given at them a delay later."""
    duties = [0.5] * 8
    world = TachobotWorld(parameters_of(plant, lag_s), lambda: tuple(duties))
    pushes = [
        (seconds(_SPIN_UP_S + t + plant.delay_s), 0, u) for t, u in zip(at, given, strict=True)
    ]
    looks = [(seconds(_SPIN_UP_S + t), 1, 0.0) for t in at]
    found: list[tuple[float, float]] = []
    for instant, is_look, push in sorted([*pushes, *looks]):
        world.advance(instant)
        if is_look:
            state = world.state(instant)
            found.append((state.yaw_rad, state.yaw_rate_rad_s))
            continue
        half = 0.5 * push / (4.0 * PAIR_N * LEVER_ARM_M)
        duties[:] = [0.5 + half, 0.5 - half, 0.5 - half, 0.5 + half] * 2
    position, rate = np.array(found).T
    return position, rate
