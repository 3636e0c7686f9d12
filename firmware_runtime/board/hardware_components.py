"""Which components of a robot's model have hardware: those from which a line can be reached.

A chip's driver holds its bus or port, a hardware model holds the driver. What a component refers to
is followed through attributes, containers, bound methods and closures, but not into classes,
modules or other components. So a package need not say which of its components have hardware.
"""

from collections.abc import Collection, Iterator
from gc import get_referents
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import cast

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import Owner

_LEFT_OUT = (type, ModuleType, CodeType, BuiltinFunctionType, str, bytes, int, float)


def holders(model: Coupled, lines: Collection[object]) -> tuple[str, ...]:
    """The names of the components that hold one of these lines, in order of declaration.

    The model must not have been run: then each component is tied to those it feeds.
    """
    wanted = {id(line) for line in lines}
    return tuple(name for name, each in model.components.items() if _reaches(each, wanted))


def _reaches(component: Component, wanted: set[int]) -> bool:
    seen = {id(component)}
    waiting: list[object] = [component]
    while waiting:
        for each in _referents(waiting.pop()):
            if id(each) in wanted:
                return True
            kind = type(each)  # and not `isinstance`: that may run a function of the object's
            if id(each) not in seen and not issubclass(kind, _LEFT_OUT):
                seen.add(id(each))
                if not issubclass(kind, Owner) or _is_below(cast("Owner", each), component):
                    waiting.append(each)
    return False


def _referents(found: object) -> Iterator[object]:
    """What an object refers to; a function only to what it was made with, not to its module."""
    if type(found) is FunctionType:
        yield from (found.__closure__, found.__defaults__, found.__kwdefaults__)
    else:
        yield from get_referents(found)


def _is_below(owner: Owner, component: Component) -> bool:
    above: Owner | None = owner
    while above is not None and above is not component:
        above = above.parent
    return above is component
