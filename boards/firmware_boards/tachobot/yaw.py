"""Yaw as a body to identify and to tune for: what turns it, what is measured, and its loop."""

from typing import Final

from firmware_boards.tachobot.settings import TachobotSettings
from firmware_runtime.board.plants import PidLoop, Plant, Signal


def _lever_arm(settings: TachobotSettings) -> float:
    return settings.world.lever_arm_m


YAW: Final = Plant(
    title="yaw on the platform",
    structure="rotation",
    input=Signal(
        ("controller.forces",),
        {"f1": 1.0, "f2": -1.0, "f3": 1.0, "f4": -1.0},
        scale=_lever_arm,
    ),
    output=Signal(("imu.sample",), {"rate.2": 1.0}),
    measures="rate",
    lag_s=lambda settings: settings.world.motor_lag_s,
    loop=PidLoop(
        kp="controller.yaw.kp",
        ki="controller.yaw.ki",
        kd="controller.yaw.kd",
        gain=lambda settings: 2.0 * settings.world.lever_arm_m,
        limit=lambda settings: 2.0 * settings.pair_thrust_n,
        period_s=lambda settings: settings.controller.period_s,
        delay_s=lambda settings: settings.controller.yaw.delay_s,
    ),
    stated={
        "inertia_kg_m2": lambda settings: settings.world.yaw_inertia_kg_m2,
        "damping_nms": lambda settings: settings.world.yaw_damping_nms,
        "coulomb_friction_nm": lambda settings: settings.world.coulomb_friction_nm,
        "static_friction_nm": lambda settings: settings.world.static_friction_nm,
        # From the forces that leave the controller to the sample that shows what they did.
        "delay_s": lambda settings: settings.controller.period_s,
    },
)
