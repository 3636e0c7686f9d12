"""TachoBot's experiments: those of the paper's section 6, by name.

A function that runs one is named here and imported with it: a robot's own start reads this.
"""

from collections.abc import Mapping
from typing import Final

from msgspec.structs import replace

from firmware_runtime.board.experiments import Experiment, OwnExperiment, StepExperiment

PAPER: Final = "Pecker Marcosig, Giribet, Castro: DEVS-over-ROS (DoveR), 2018"

YAW_STEP: Final = StepExperiment(
    title="Step of the yaw reference",
    figure="Figure 10",
    port="yaw_reference",
    begin=0.0,
    end=1.0,
    quantity="yaw",
    unit="rad",
    beside={"Angular speed, rad/s": "world.yaw_rate_rad_s"},
    settings={"controller.yaw.reference_rad": 0.0},
    paper={"reference_rad": 1.0},
    published=(
        f"{PAPER}, Figures 10 and 11.",
        "The reference is 1 rad, in simulation (Figure 10) and over ROS (Figure 11, about 5 s).",
        "The two differ by the delay of two ROS nodes, in the order of 7 ms, says the text.",
        "It gives neither rise time nor overshoot.",
    ),
)
NETWORK_YAW_STEP: Final = replace(
    YAW_STEP,
    title="Step of the yaw reference, with a network in the loop",
    figure="Figure 11",
    paper={"reference_rad": 1.0, "network_loop_delay_ms": 7.0},
    stages=("network",),
)
_WAVE: Final = (
    "The robot's actuators got a square wave; yaw and angular speed were measured (14). The "
    "simulation model got the same wave, and its parameters, such as the mass, were adjusted until "
    "its curves (15) looked quite similar."
)
SQUARE_WAVE: Final = OwnExperiment(
    title="A square wave into the propellers, in open loop",
    figure="Figures 14 and 15",
    published=(
        f"{PAPER}, Figures 14 and 15.",
        _WAVE,
        "The text gives neither the wave nor a number.",
        "Here the robot is its doubles: motors that lag, a bearing with friction, a noisy gyro.",
    ),
    settings={
        "controller.yaw.wave.amplitude_n": 0.2,
        "controller.yaw.wave.period_s": 4.0,
        "controller.yaw.wave.begin_s": 1.0,
        "controller.yaw.wave.cycles": 4,
        "world.yaw_damping_nms": 0.012,
        "world.coulomb_friction_nm": 0.006,
        "world.static_friction_nm": 0.009,
    },
    stages=("simulation", "embedded"),
    run="firmware_boards.tachobot.experiments.square_wave:run",
)

IDENTIFICATION: Final = OwnExperiment(
    title="Inertia, friction and delay identified from the square wave",
    figure="Figures 14 and 15",
    published=(
        f"{PAPER}, Figures 14 and 15.",
        _WAVE,
        "The adjusting was by eye, and the text gives no number that came of it.",
        "Here it is least squares, and the robot its doubles, whose world is known.",
    ),
    settings=SQUARE_WAVE.settings,
    stages=("simulation",),
    packages=("scipy>=1.13",),
    run="firmware_boards.tachobot.experiments.identification:run",
)

_BEGINNING: Final = (
    "A delay of about 2 s at the beginning, due to initialization; then the robot starts the wrong "
    "way, likely because of a motor that was found to malfunction later; from around 4 s on it "
    "behaves as expected."
)
_STUCK: Final = (
    "Between 8.3 s and 10.4 s yaw is stuck with zero angular speed, by the static friction of the "
    "rotating platform, while the control effort grows by the integral; then it is released."
)
_AGAIN: Final = (
    "Around 20.5 s it is stuck again, close to the reference, with neither error nor control "
    "action zero."
)
_OURS: Final = (
    "The text gives neither gains nor friction: those here were chosen so that it is stuck at a "
    "like time. The wrong way at the beginning is not modelled."
)
EMBEDDED_STEP_FRICTION: Final = OwnExperiment(
    title="Embedded step with static friction: stuck, and released",
    figure="Figures 16 and 17",
    published=(f"{PAPER}, Figures 16 and 17.", _BEGINNING, _STUCK, _AGAIN, _OURS),
    paper={
        "initial_delay_s": 2.0,
        "stuck_from_s": 8.3,
        "stuck_until_s": 10.4,
        "stuck_again_from_s": 20.5,
    },
    settings={
        "controller.yaw.kp": 0.3,
        "controller.yaw.ki": 0.2,
        "controller.yaw.kd": 0.25,
        "imu.calibration_s": 1.75,
        "world.static_friction_nm": 0.035,
        "world.coulomb_friction_nm": 0.0175,
    },
    stages=("simulation", "embedded"),
    run="firmware_boards.tachobot.experiments.friction:run",
)

CIRCLE: Final = OwnExperiment(
    title="A circle of one metre, by an external position",
    figure="Future work",
    published=(
        f"{PAPER}, section 7: a position tracking control for the robot is announced.",
        "There are no numbers of it.",
    ),
    settings={
        "controller.mode": "track",
        "trajectory.kind": "circle",
        "world.accelerometer_noise_m_s2": 0.05,
        "world.accelerometer_bias_m_s2": 0.05,
    },
    stages=("simulation",),
    run="firmware_boards.tachobot.experiments.circle:run",
)

SMITH: Final = OwnExperiment(
    title="The loop behind 80 ms, with a Smith predictor and without",
    published=(
        f"{PAPER}, section 6, on the delays of Figures 12 and 13.",
        "An almost constant delay can be compensated, as with a Smith predictor, says the text.",
        "It shows no such loop.",
    ),
    settings={"controller.yaw.reference_rad": 0.0},
    stages=("simulation",),
    run="firmware_boards.tachobot.experiments.smith:run",
)

LOOP_DELAY: Final = OwnExperiment(
    title="Delay of a loop: a ramp out and back",
    figure="Figures 12 and 13",
    published=(
        f"{PAPER}, Figures 12 and 13.",
        "Local, with both ROS nodes on one PC: in the order of 7 ms, almost constant.",
        "Remote, with both nodes on a Raspberry Pi over WiFi: in the order of 80 ms, varying more.",
    ),
    paper={"local_delay_ms": 7.0, "remote_delay_ms": 80.0},
    stages=("network", "remote"),
    run="firmware_runtime.lab.experiments.loop_experiment:run_loop",
)

EXPERIMENTS: Final[Mapping[str, Experiment]] = {
    "yaw-step": YAW_STEP,
    "network-yaw-step": NETWORK_YAW_STEP,
    "square-wave": SQUARE_WAVE,
    "identification": IDENTIFICATION,
    "smith": SMITH,
    "embedded-step-friction": EMBEDDED_STEP_FRICTION,
    "circle": CIRCLE,
    "loop-delay": LOOP_DELAY,
}
