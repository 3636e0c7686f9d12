"""The robot of one end of a board: what it finds and switches off, and what it knows of its run.

The end without hardware has no chips, and no end knows what became of components that ran at the
other: a result that takes one of those is none, rather than made up.
"""

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from functools import partial

from msgspec.structs import replace

from firmware_runtime.board.ends import BoardEnd
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled, with_all_below
from firmware_runtime.devs.part import Part, part_of
from firmware_runtime.devs.ports import Owner


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
