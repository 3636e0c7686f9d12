"""One end of a board that runs in two processes: its part of the model, its chips, its gains.

All hardware of a robot is at one end. That end opens the lines, finds the chips, and switches them
off; the other one opens none. Where a cut would part the hardware, it is refused.

Nothing is found out by looking into objects: components declare their `lines`, a robot declares
what its `result_from` is, and a definition which component takes up a `retunable` key.
"""

from collections.abc import Collection, Iterator
from contextlib import suppress

from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.board.registry import Board
from firmware_runtime.board.retuning import need_restart, retunable_values
from firmware_runtime.board.robot import Robot, declaring
from firmware_runtime.board.roles import CONTROLLER, ROBOT, Roles, components_of
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.part import Part, part_of
from firmware_runtime.devs.ports import Owner
from firmware_runtime.errors import ConfigError


class BoardEnd(Struct, frozen=True):
    """End of a board: what one of the two processes runs."""

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
    """Return the end of a role. Raises ConfigError for a role that is unknown or cannot be."""
    model, holding = _whole(board)
    own = components_of(board.settings.roles, model, role)
    others = tuple(name for name in model.components if name not in own)
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


def ends_of(board: Board) -> dict[str, str]:
    """Return a board's roles by end: `robot` has the hardware, `controller` computes.

    Raises ConfigError for a board whose [roles] make no two ends.
    """
    roles: Roles = board.settings.roles
    if not roles:
        fault = "no table [roles] in its board.toml; expected one, for two ends"
        raise ConfigError(board.name, [fault])
    found = {}
    for role in _roles_here(roles, board.unconnected().model):
        with suppress(ConfigError):
            found[ROBOT if end_of(board, role).has_hardware else CONTROLLER] = role
    if len(found) < 2:
        first = end_of(board, next(iter(roles)))
        fault = f"roles: {first.role} and the rest: expected one with all hardware, and one without"
        raise ConfigError(board.name, [fault])
    return found


def other_end(board: Board, end: BoardEnd) -> BoardEnd:
    """Return the other end, be there hardware at either end or at none."""
    roles: Roles = board.settings.roles
    model, elsewhere = _whole(board)[0], {*end.elsewhere}
    named = _roles_here(roles, model)
    return end_of(board, next(r for r in named if elsewhere >= {*components_of(roles, model, r)}))


def role_without_hardware(board: Board) -> str:
    """The role that computes: `controller`, unless a board calls it something else.

    Of a board in more than two parts it is the first such role. Components that no role names are
    the controller, but they may be the ones with the hardware.
    Raises ConfigError for a board without roles, or whose every role has hardware.
    """
    roles: Roles = board.settings.roles
    model, holding = _whole(board)
    for role in _roles_here(roles, model):
        if not {*components_of(roles, model, role)} & {*holding}:
            return role
    fault = f"{board.name}: hardware at both ends; expected one role without any"
    raise ConfigError("roles", [fault])


def check_ends(board: Board) -> None:
    """Raise ConfigError, as a run of either end would, unless the roles make two ends."""
    for role in _named_here(board.settings.roles, board.unconnected().model):
        end_of(board, role)


def robot_of(end: BoardEnd, whole: Robot) -> tuple[Robot, Part]:
    """Return the robot of one end, and its part of the model.

    What the whole model has besides its own components was added by a rig, and goes with the chips.
    The other end has nothing to find or to switch off; its result is empty where it would take
    components that run elsewhere.
    """
    names = set(end.components)
    if end.has_hardware:
        names |= whole.model.components.keys() - set(end.elsewhere)
    part = part_of(whole.model, names)
    has_result = bool(whole.result_from) and names.issuperset(whole.result_from)
    kept = replace(
        whole,
        model=part.model,
        result=whole.result if has_result else dict,
        ended=whole.ended if _is_of(part.model, whole.ended) else None,
        shown=whole.shown if _is_of(part.model, whole.shown) else None,
    )
    if not end.has_hardware:
        kept = replace(kept, probe=(), stop=(), still_on=(), unseen=(), warnings=())
    return kept, part


def _is_of(model: Coupled, port: object) -> bool:
    """Return whether a port's owner is part of a model."""
    owner: Owner | None = getattr(port, "owner", None)
    while owner is not None and owner is not model:
        owner = owner.parent
    return owner is not None


def gains_elsewhere(board: Board, end: BoardEnd) -> frozenset[str]:
    """Return the retunable keys that only components of the other end take up."""

    def taken_by(components: Collection[str]) -> set[str]:
        patterns = [each for name in components for each in board.gains.get(name, ())]
        return keys.difference(need_restart([*keys], patterns))

    keys = set(retunable_values(board.settings, board.retunable))
    return frozenset(taken_by(end.elsewhere) - taken_by(end.components))


def _whole(board: Board) -> tuple[Coupled, tuple[str, ...]]:
    """Return a board's whole model, not run, and its components with hardware, in its order."""
    model = board.unconnected().model
    return model, declaring(model, "lines")


def _roles_here(roles: Roles, model: Coupled) -> list[str]:
    """The roles that have components here: first the controller, if some are left to it."""
    left = _unnamed(roles, model)
    return [*dict.fromkeys([*([CONTROLLER] if left else []), *_named_here(roles, model)])]


def _named_here(roles: Roles, model: Coupled) -> list[str]:
    """The roles that name a component of this model: some are there with other settings only."""
    return [
        role for role, names in roles.items() if any(name in model.components for name in names)
    ]


def _unnamed(roles: Roles, model: Coupled) -> set[str]:
    """The components that no role names."""
    return {*model.components}.difference(*roles.values())


def _three_parts(board: Board, model: Coupled, role: str, others: tuple[str, ...]) -> Iterator[str]:
    """A link has two ends: what is left must be one role's."""
    if not others:
        yield f"roles.{role}: names every component; expected some that another role runs"
    roles: Roles = board.settings.roles
    third = [name for name in _named_here(roles, model) if name != role]
    unnamed = _unnamed(roles, model)
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
