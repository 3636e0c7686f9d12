"""Experiments of a board: what a definition says of them, by name.

A step: the reference at an input port of the model jumps, and a value is watched over time. The
board says which port, from where to where, and what it measures; `firmware-runtime experiment` runs
it in every stage.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class StepExperiment:
    """A reference that jumps at `at_s` of the controller's run; its answer is the shown value.

    What is shown is the rig's port, or the robot's own without one.
    """

    title: str
    """Such as `Step of the yaw reference`."""
    port: str
    """The input port of the top model that the reference goes into."""
    begin: float
    """The reference before; the value that is shown is expected there."""
    end: float
    """The reference after."""
    quantity: str
    """What is shown, such as `yaw`."""
    unit: str
    settings: Mapping[str, float] = field(default_factory=dict)
    """Numbers of board.toml for this experiment, such as the reference's first value."""
    at_s: float = 3.0
    """Late enough for sensors to be calibrated, and for a link to be good."""
    watched_s: float = 10.0
    """How long the answer is watched."""
    published: Sequence[str] = ()
    """What others measured, in sentences, with its source first."""

    @property
    def for_s(self) -> float:
        """How long a run of it takes."""
        return self.at_s + self.watched_s

    @property
    def assignments(self) -> list[str]:
        """Its settings, as `--set` has them."""
        return [f"{key}={value}" for key, value in self.settings.items()]
