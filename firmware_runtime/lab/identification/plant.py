"""The plant that is identified: a body that is pushed or turned against friction, behind a delay.

    inertia * d(rate)/dt = drive - damping * rate - friction,   lag * d(drive)/dt = input - drive

`friction` is `coulomb` against the motion; at rest it holds any drive up to `static`. The input
acts `delay_s` after it was given. All SI: N and m, or N m and rad.
"""

from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

Numbers: TypeAlias = NDArray[np.floating[Any]]
Places: TypeAlias = NDArray[np.int64]
Structure: TypeAlias = Literal["rotation", "translation"]

NAMES: Final = ("inertia", "damping", "coulomb", "static", "delay_s")
KEYS: Final[dict[Structure, tuple[str, ...]]] = {
    "rotation": (
        "inertia_kg_m2",
        "damping_nms",
        "coulomb_friction_nm",
        "static_friction_nm",
        "delay_s",
    ),
    "translation": (
        "mass_kg",
        "damping_ns_m",
        "coulomb_friction_n",
        "static_friction_n",
        "delay_s",
    ),
}
"""Names of the parameters where a person or a program reads them."""


@dataclass(frozen=True, slots=True)
class PlantParameters:
    """The five numbers."""

    inertia: float
    damping: float
    coulomb: float
    static: float
    delay_s: float

    @property
    def values(self) -> tuple[float, ...]:
        """In the order of `NAMES`."""
        return (self.inertia, self.damping, self.coulomb, self.static, self.delay_s)
