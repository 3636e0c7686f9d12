"""Experiments of a board by name, and its plant: what a definition says of them.

Two kinds: a `StepExperiment` is numbers alone, and the runtime runs it in every stage;
an `OwnExperiment` names a function of any package that runs the board as it likes and returns what
it found. `firmware-runtime experiment NAME BOARD -o FOLDER` runs either and writes the files.

Nothing here imports what runs an experiment: a robot's own start reads its definition.

A plant is the body that a board moves: for `identify` from a recording, and `tune`.

    PLANT = Plant(
        title="the wheel",
        structure="rotation",
        input=Signal(("controller.forces",), {"f1": 1.0, "f2": -1.0}, scale=lever_arm),
        output=Signal(("gyro.sample",), {"rate.2": 1.0}),
        measures="rate",
    )
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, Literal, TypeAlias

from msgspec import Struct, field

Number: TypeAlias = Callable[[Any], float]
"""Of a board's settings."""

STRUCTURES: Final = ("rotation", "translation")
MEASURED: Final = ("rate", "position")


def _one(_settings: object) -> float:
    return 1.0


def _nothing(_settings: object) -> float:
    return 0.0


class Signal(Struct, frozen=True):
    """`scale` times the sum of the weighted numbers; a number goes by its place in the value.

    A place is a field's name or a position, and what is in it behind a dot, such as `rate.2`; the
    empty one is the value itself.
    """

    ports: Sequence[str]
    terms: Mapping[str, float]
    scale: Number = _one


class PidLoop(Struct, frozen=True, kw_only=True):
    """The loop that `tune` finds gains for: a `models.pid` block, and what its command does."""

    kp: str
    """Key of board.toml, and so on."""
    ki: str
    kd: str
    gain: Number
    """Force in N, or moment in N m, per unit of the PID's command."""
    limit: Number
    """The command is kept within plus and minus this."""
    period_s: Number
    step: Number = _one
    """A typical step of the reference: m, or rad."""
    delay_s: Number = _nothing
    """What the settings put between the command and the actuators, beside the plant's own."""


class Plant(Struct, frozen=True, kw_only=True):
    """A body that is pushed or turned against friction."""

    title: str
    """Such as `yaw on the platform`."""
    structure: Literal["rotation", "translation"]
    input: Signal
    """What is pushed with: N, or N m."""
    output: Signal
    """What is measured: m or rad, or those a second."""
    measures: Literal["rate", "position"]
    lag_s: Number = _nothing
    """Time constant of the actuators, which is taken as known."""
    loop: PidLoop | None = None
    """None: there are no gains that `tune` could find."""
    stated: Mapping[str, Number] = {}
    """What the settings say of it, for `tune BOARD --plant`: mass or inertia, damping, both
    frictions and delay, by the keys that `identify` prints; friction and delay left out are none.
    """


def plant_fault(plant: object) -> str | None:
    """Return what is wrong with a definition's plant, in a sentence, or None."""
    if plant is None:
        return None
    if not isinstance(plant, Plant):
        return f"plant: {plant!r}: expected a Plant"
    if plant.structure not in STRUCTURES:
        return f"plant.structure: {plant.structure!r}: expected one of {', '.join(STRUCTURES)}"
    if plant.measures not in MEASURED:
        return f"plant.measures: {plant.measures!r}: expected one of {', '.join(MEASURED)}"
    return None


ALL: Final = "all"
"""Not the name of an experiment: it stands for every one of a board."""
_NAME: Final = r"[a-z0-9]+(-[a-z0-9]+)*"
_PACKAGE: Final = r"[A-Za-z0-9]"
_FUNCTION: Final = r"[^\W\d]\w*(\.[^\W\d]\w*)*:[^\W\d]\w*"


class Experiment(Struct, frozen=True, kw_only=True):
    """Declaration of an experiment, of either kind."""

    title: str
    """Such as `Step of the yaw reference`."""
    figure: str = ""
    """What was published of it, such as `Figures 12 and 13`; empty if nothing was."""
    published: Sequence[str] = ()
    """What others measured, in sentences, with its source first."""
    paper: Mapping[str, float] = field(default_factory=dict)
    """The numbers that the published text gives; units are in the keys, such as `delay_ms`."""
    settings: Mapping[str, object] = field(default_factory=dict)
    """Values of board.toml for this experiment, by dotted key."""
    stages: Sequence[str] = ()
    """Stages that it makes sense in, by name; none: all that the board has."""
    packages: Sequence[str] = ()
    """What it imports beside what the robot needs, as pip takes it, such as `scipy>=1.13`."""

    @property
    def assignments(self) -> list[str]:
        """Its settings, as `--set` has them."""
        from firmware_runtime.board.assignments import assignments_of  # noqa: PLC0415 -- to run it

        return assignments_of(self.settings)


class StepExperiment(Experiment, frozen=True, kw_only=True):
    """A reference that jumps at `at_s` of the controller's run, and the value that answers."""

    port: str
    """The input port of the top model that the reference goes into."""
    begin: float
    """The reference before; the value that answers is expected there."""
    end: float
    """The reference after."""
    quantity: str
    """What answers, such as `yaw`."""
    unit: str
    answer: str = ""
    """Its port, such as `world.place_m`; left out: the one that the rig shows, or the robot."""
    beside: Mapping[str, str] = field(default_factory=dict)
    """More ports to draw over time, by title with unit: `{"Speed, m/s": "world.speed"}`."""
    at_s: float = 3.0
    """Late enough for sensors to be calibrated, and for a link to be good."""
    watched_s: float = 10.0
    """How long the answer is watched."""

    @property
    def for_s(self) -> float:
        """Length of a run of it, s."""
        return self.at_s + self.watched_s


class OwnExperiment(Experiment, frozen=True, kw_only=True):
    """One that a function runs: `package.module:function`, imported when the experiment is run.

    It is called with a `firmware_runtime.lab.experiments.trial.Trial` and returns a
    `firmware_runtime.lab.experiments.findings.Findings`.
    """

    run: str


def experiment_faults(experiments: object) -> Iterator[str]:
    """Everything wrong with what a definition calls its experiments."""
    if not isinstance(experiments, Mapping) or not all(
        isinstance(each, StepExperiment | OwnExperiment) for each in experiments.values()
    ):
        yield f"experiments: {experiments!r}: expected StepExperiments and OwnExperiments by name"
        return
    for name, each in experiments.items():
        if not (isinstance(name, str) and re.fullmatch(_NAME, name)) or name == ALL:
            expected = f"expected small letters, digits and single -, and not {ALL!r}"
            yield f"experiments: {name!r}: {expected}"
        if bad := [package for package in each.packages if not re.match(_PACKAGE, package)]:
            yield f"experiments.{name}.packages: {bad[0]!r}: expected a package as pip takes it"
        if isinstance(each, OwnExperiment) and not re.fullmatch(_FUNCTION, each.run):
            yield f"experiments.{name}.run: {each.run!r}: expected package.module:function"
