"""The detective's experiments: that of the paper's Figure 6, and a mission in the arena.

A function that runs one is named here and imported with it: a robot's own start reads this.
"""

from collections.abc import Mapping
from typing import Final

from firmware_runtime.board.experiments import Experiment, OwnExperiment

PAPER: Final = "Application of RT-DEVS in Military"

FIGURE_6: Final = OwnExperiment(
    title="The mission of the paper's event file",
    figure="Figure 6",
    published=(
        f"{PAPER}, section 3.3, Figure 6: an event file of ten events beside the output file.",
        "It is compared line by line, instants to the millisecond.",
        "The fourth field of 00:00:09:50 is read as 50 ms: README.md says why.",
    ),
    paper={"output_lines": 11},
    stages=("simulation",),
    run="firmware_boards.detective.experiments.figure_6:run",
)

MISSION: Final = OwnExperiment(
    title="A mission in the arena: find the target, turn, and stop before it",
    published=(
        f"{PAPER}, section 3.3: the robot passed several tests from different angles, on video.",
        "It gives no numbers.",
    ),
    stages=("simulation", "network", "remote", "embedded"),
    run="firmware_boards.detective.experiments.mission:run",
)

EXPERIMENTS: Final[Mapping[str, Experiment]] = {"figure-6": FIGURE_6, "mission": MISSION}
