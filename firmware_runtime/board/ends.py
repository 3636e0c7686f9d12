"""One end of a board that runs in two processes: its part of the model, and whether it has chips.

All hardware of a robot is at one end. That end opens the lines, finds the chips, and switches them
off; the other one opens none. Where a cut would part the hardware, it is refused.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

from firmware_runtime.board.holding import holders
from firmware_runtime.board.lines import absent_lines
from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Robot
from firmware_runtime.board.roles import CONTROLLER, Roles, components_of
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled, with_all_below
from firmware_runtime.devs.part import Part, part_of
from firmware_runtime.devs.ports import Owner
from firmware_runtime.errors import ConfigError


@dataclass(frozen=True, slots=True)
class BoardEnd:
    """What one of the two processes runs."""

    role: str
    name: str
    """By which its statistics and sockets are known: the board's where the hardware is."""
    components: tuple[str, ...]
    elsewhere: tuple[str, ...]
    """The components that the other process runs."""
    has_hardware: bool
    crossings: frozenset[str]
    """The output ports of components whose values cross to the other end, or from there."""


def end_of(board: Board, role: str) -> BoardEnd:
    """What a role runs. Raises ConfigError for one that the board has not, or that cannot be."""
    lines = absent_lines(board.settings.buses, board.ports)
    model = board.build(lines).model
    own = components_of(board.settings.roles, model, role)
    others = tuple(name for name in model.components if name not in own)
    holding = holders(model, [*lines.buses.values(), *lines.ports.values()])
    faults = [*_three_parts(board, model, role, others), *_parted(holding, own, role)]
    if faults:
        raise ConfigError(board.name, faults)
    part = part_of(model, own)
    has_hardware = bool(holding) and holding[0] in own
    return BoardEnd(
        role,
        board.name if has_hardware else f"{board.name}.{role}",
        tuple(own),
        others,
        has_hardware,
        frozenset((*part.entering, *part.leaving)),
    )


def role_without_hardware(board: Board) -> str:
    """The role that computes: `controller`, unless a board calls it something else.

    Components that no role names are the controller, but they may be the ones with the hardware.
    Raises ConfigError for a board without roles, or whose every role has hardware.
    """
    roles: Roles = board.settings.roles
    lines = absent_lines(board.settings.buses, board.ports)
    model = board.build(lines).model
    holding = {*holders(model, [*lines.buses.values(), *lines.ports.values()])}
    unnamed = {*model.components}.difference(*roles.values())
    if unnamed or not roles:
        computing = components_of(roles, model, CONTROLLER)  # raises where there are no roles
        if not holding & {*computing}:
            return CONTROLLER
    for role, names in roles.items():
        if {*names} & {*model.components} and not holding & {*names}:
            return role
    fault = f"{board.name}: hardware at both ends; expected one role without any"
    raise ConfigError("roles", [fault])


def check_ends(board: Board) -> None:
    """Raise ConfigError, as a run of either end would, unless the roles make two ends."""
    model = board.build(absent_lines(board.settings.buses, board.ports)).model
    for role, names in board.settings.roles.items():
        if any(name in model.components for name in names):
            end_of(board, role)


def _three_parts(board: Board, model: Coupled, role: str, others: tuple[str, ...]) -> Iterator[str]:
    """A link has two ends: what is left must be one role's."""
    if not others:
        yield f"roles.{role}: names every component; expected some that another role runs"
    roles: Mapping[str, Collection[str]] = board.settings.roles
    third = [
        name
        for name, named in roles.items()
        if name != role and any(each in model.components for each in named)
    ]
    unnamed = {*model.components} - {each for named in roles.values() for each in named}
    if len(third) > 1 or (third and role in roles and unnamed):
        rest = [*third, *(["controller"] if unnamed and role in roles else [])]
        yield f"roles: {', '.join(rest)} beside {role}: expected two parts, for a link has two ends"


def _parted(holding: Collection[str], own: Collection[str], role: str) -> Iterator[str]:
    here = [name for name in holding if name in own]
    there = [name for name in holding if name not in own]
    if here and there:
        yield (
            f"roles.{role}: hardware in {', '.join(here)}, and at the other end in "
            f"{', '.join(there)}; expected all of it in one role: one process finds the chips and "
            "switches them off"
        )


def robot_of(end: BoardEnd, whole: Robot) -> tuple[Robot, Part]:
    """The robot of one end; what the whole model has besides its own components comes with chips.

    That is what a rig has added. The other end has nothing to find or to switch off.
    """
    absent = [whole.model.components[name] for name in end.elsewhere]
    names = set(end.components)
    if end.has_hardware:
        names |= whole.model.components.keys() - set(end.elsewhere)
    part = part_of(whole.model, names)
    kept = replace(
        whole,
        model=part.model,
        result=partial(_known_here, whole.result, absent),
        ended=whole.ended if _is_of(part.model, whole.ended) else None,
        shown=whole.shown if _is_of(part.model, whole.shown) else None,
    )
    if not end.has_hardware:
        kept = replace(kept, probe=(), stop=(), still_on=(), unseen=(), warnings=())
    return kept, part


def _is_of(model: Coupled, port: object) -> bool:
    """Whether a port's owner is part of a model."""
    owner: Owner | None = getattr(port, "owner", None)
    while owner is not None and owner is not model:
        owner = owner.parent
    return owner is not None


# A result that is not made up ---------------------------------------------------------------------


class _RunsElsewhere(Exception):
    """A component is asked that another process runs."""


def _known_here(
    result: Callable[[], dict[str, object]], absent: Collection[Component]
) -> dict[str, object]:
    """What the robot knows by its components here; nothing if it takes one that never ran."""
    try:
        with _closed(absent):
            return result()
    except _RunsElsewhere:
        return {}


@contextmanager
def _closed(components: Collection[Component]) -> Iterator[None]:
    """Within the block every look at one of these raises `_RunsElsewhere`."""
    all_of_them = [each for component in components for each in with_all_below(component)]
    kinds = [type(each) for each in all_of_them]
    closed: dict[type[Component], type[Component]] = {
        kind: type(kind.__name__, (kind,), {"__slots__": (), "__getattribute__": _refuse})
        for kind in kinds
    }
    try:
        for each, kind in zip(all_of_them, kinds, strict=True):
            each.__class__ = closed[kind]
        yield
    finally:
        for each, kind in zip(all_of_them, kinds, strict=True):
            each.__class__ = kind


def _refuse(_component: object, _name: str) -> object:
    raise _RunsElsewhere
