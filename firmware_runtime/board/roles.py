"""Roles: which components of a board's top model run in which process, as its file says.

    [roles]
    robot = ["imu", "thrust_pairs", "esc"]

Components that no role names are the `controller`, unless the file says what that is. A component
that this robot does not have, as TachoBot's esc outside mode free, is named in vain.
"""

from collections.abc import Mapping
from typing import Final

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.part import Part, part_of
from firmware_runtime.errors import ConfigError

CONTROLLER: Final = "controller"
ROBOT: Final = "robot"

Roles = Mapping[str, tuple[str, ...]]


def components_of(roles: Roles, model: Coupled, role: str) -> list[str]:
    """The components of a role, in order of declaration.

    Raises ConfigError for a role that the board has not, or that has no component here.
    """
    taken = {name for names in roles.values() for name in names}
    if role in roles:
        found = [name for name in model.components if name in roles[role]]
    elif role == CONTROLLER and roles:
        found = [name for name in model.components if name not in taken]
    else:
        known = ", ".join(dict.fromkeys((*roles, CONTROLLER))) if roles else "a table [roles]"
        raise ConfigError("roles", [f"{role}: this board has no such role; expected {known}"])
    if not found:
        raise ConfigError("roles", [f"{role}: no component is left for it; expected one or more"])
    return found


def part_for(roles: Roles, model: Coupled, role: str) -> Part:
    """The part of a top model that plays a role; the model must not be used any more."""
    return part_of(model, components_of(roles, model, role))
