"""The one table of chips that can be tried out, by the names of the command line."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from drivers.catalogue.actuators import ACTUATORS
from drivers.catalogue.sensors import SENSORS
from drivers.catalogue.trial import Triable

CHIPS: Final[Mapping[str, Triable]] = MappingProxyType(
    {chip.name: chip for chip in (*SENSORS, *ACTUATORS)}
)
