"""Plant of a board, the body that it moves: for `identify` from a recording, and `tune`.

    PLANT = Plant(
        title="the wheel",
        structure="rotation",
        input=Signal(("controller.forces",), {"f1": 1.0, "f2": -1.0}, scale=lever_arm),
        output=Signal(("gyro.sample",), {"rate.2": 1.0}),
        measures="rate",
    )

A signal is a sum of numbers in the values of a port, each with a weight. Of several ports the first
that is there is taken; a coupled model's port means what is sent through it.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, Literal, TypeAlias

from msgspec import Struct

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
