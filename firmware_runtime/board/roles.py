"""Stages and roles: the parts of a board's top model, and the processes that they run in.

The four stages of a robot whose controller never changes: Pecker Marcosig, Giribet, Castro:
DEVS-over-ROS (DoveR), Winter Simulation Conference 2018, section 3.

Roles, as a board's file names them:

    [roles]
    robot = ["imu", "thrust_pairs", "esc"]

Components that no role names are the `controller`, unless the file says what that is. A component
that this robot does not have, as TachoBot's esc outside mode free, is named in vain; its definition
lists such components.
"""

import re
from collections.abc import Collection, Iterator, Mapping
from enum import StrEnum
from math import isfinite
from typing import Final

from firmware_runtime.board.settings import LinkSettings
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.errors import ConfigError


class Stage(StrEnum):
    """Places of controller and plant, and the link between them."""

    SIMULATION = "simulation"
    """Both in one process, on doubles, in virtual time."""
    NETWORK = "network"
    """Two processes of this machine in real time, the plant on doubles, a network between them."""
    REMOTE = "remote"
    """The controller here, the robot end on another machine, or behind a bad network."""
    EMBEDDED = "embedded"
    """Both in one process in real time, on chips or on doubles."""

    @property
    def has_two_ends(self) -> bool:
        """Return whether controller and robot end are processes of their own."""
        return self in {Stage.NETWORK, Stage.REMOTE}


CONTROLLER: Final = "controller"
ROBOT: Final = "robot"

Roles = Mapping[str, tuple[str, ...]]
_NAME: Final = r"[a-z0-9][a-z0-9_-]{0,30}"


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


# Faults of the tables [roles] and [link] ----------------------------------------------------------


def role_faults(
    roles: Roles, link: LinkSettings, model: Coupled, elsewise: Collection[str]
) -> list[str]:
    """Everything wrong with the roles of components, and with what is stated of the ports between.

    `elsewise` are components, and ports of components, that the model has with other settings only.
    """
    known = {*model.components, *(name for name in elsewise if "." not in name)}
    misnamed = [*_names(roles, known), *_doubled(roles)]
    crossing = [] if misnamed else _no_crossings(roles, link, model, elsewise)
    return [*misnamed, *_without_effect(roles, link), *_limits(link), *crossing]


def _names(roles: Roles, known: Collection[str]) -> Iterator[str]:
    for role, names in roles.items():
        if not re.fullmatch(_NAME, role):
            yield f"roles.{role}: expected small letters, digits, - and _, 31 at most"
        if not names:
            yield f"roles.{role}: names no component; expected one or more"
        for name in names:
            if name not in known:
                yield f"roles.{role}: {name!r}: expected some of {', '.join(sorted(known))}"


def _doubled(roles: Roles) -> Iterator[str]:
    taken: dict[str, str] = {}
    for role, names in roles.items():
        for name in names:
            first = taken.setdefault(name, role)
            if first != role:
                yield f"roles.{role}: {name!r} is in roles.{first} already; expected it in one"
        for name in {name for name in names if names.count(name) > 1}:
            yield f"roles.{role}: {name!r} is named twice; expected it once"


def _without_effect(roles: Roles, link: LinkSettings) -> Iterator[str]:
    if not roles and link != LinkSettings():
        yield "link: has no effect without a table [roles]"


def _limits(link: LinkSettings) -> Iterator[str]:
    for name, (least, greatest) in link.limits.items():
        if not (isfinite(least) and isfinite(greatest) and least <= greatest):
            stated = f"link.limits.{name}: [{least:g}, {greatest:g}]"
            yield f"{stated}: expected finite numbers, the first not above the second"


def _no_crossings(
    roles: Roles, link: LinkSettings, model: Coupled, elsewise: Collection[str]
) -> Iterator[str]:
    """Ports that are named in [link] and cross no cut between two roles."""
    crossing = crossings(roles, model)
    stated = {"limits": link.limits, "retain": link.retain, "ordered": link.ordered}
    for key, names in stated.items():
        for name in names:
            if roles and not {name, name.partition(".")[0]} & {*crossing, *elsewise}:
                some = (
                    f"some of {', '.join(sorted(crossing))}"
                    if crossing
                    else "none, as nothing does"
                )
                yield f"link.{key}: {name!r} crosses no cut between roles; expected {some}"


def crossings(roles: Roles, model: Coupled) -> set[str]:
    """The output ports of components that feed a component of another role, by path."""
    role_of = {name: role for role, names in roles.items() for name in names}
    found: set[str] = set()
    for source, destination in model.couplings:
        begin, end = source.owner, destination.owner
        if model not in {begin, end} and role_of.get(begin.name) != role_of.get(end.name):
            found.add(source.path.removeprefix(f"{model.path}."))
    return found
