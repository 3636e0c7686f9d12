"""TachoBot's experiments: those of the paper's section 6, by name.

A function that runs one is named here and imported with it: a robot's own start reads this.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from firmware_runtime.board.experiments import Experiment, StepExperiment

PAPER: Final = "Pecker Marcosig, Giribet, Castro: DEVS-over-ROS (DoveR), 2018"

YAW_STEP: Final = StepExperiment(
    title="Step of the yaw reference",
    figure="Figure 10",
    port="yaw_reference",
    begin=0.0,
    end=1.0,
    quantity="yaw",
    unit="rad",
    settings={"controller.yaw.reference_rad": 0.0},
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
    stages=("network",),
)

EXPERIMENTS: Final[Mapping[str, Experiment]] = {
    "yaw-step": YAW_STEP,
    "network-yaw-step": NETWORK_YAW_STEP,
}
