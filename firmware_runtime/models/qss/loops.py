"""Algebraic loops of blocks: a value that depends at once on itself has none, or more than one."""

from collections.abc import Iterator, Sequence
from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.errors import ModelError
from firmware_runtime.devs.ports import AnyPort, InPort


def refuse_loop(block: Atomic) -> None:
    """Raise ModelError if what a block sends comes back to it at once, through blocks alone.

    A block says by `direct` which of its input ports its output answers at once; an integrator
    and a delay have none.
    """
    way = _way(block, block, {block})
    if way is not None:
        names = " -> ".join(each.path for each in (block, *way))
        raise ModelError(f"{names}: an algebraic loop; expected an integrator or a delay within it")


def _way(begin: Atomic, end: Atomic, seen: set[Atomic]) -> list[Atomic] | None:
    for following in _fed_at_once(begin):
        if following is end:
            return [end]
        if following not in seen:
            seen.add(following)
            way = _way(following, end, seen)
            if way is not None:
                return [following, *way]
    return None


def _fed_at_once(block: Atomic) -> Iterator[Atomic]:
    for port in block.out_ports.values():
        for reached in _ends(port):
            owner = reached.owner
            direct: Sequence[InPort[Any]] = getattr(owner, "direct", ())
            if isinstance(owner, Atomic) and any(reached is each for each in direct):
                yield owner


def _ends(port: AnyPort) -> Iterator[InPort[Any]]:
    """The input ports of atomic models to which a port's values get, through coupled ones."""
    scope = port.owner if isinstance(port, InPort) else port.owner.parent
    if isinstance(scope, Coupled):
        for source, destination in scope.couplings:
            if source is port:
                if isinstance(destination, InPort) and isinstance(destination.owner, Atomic):
                    yield destination
                else:
                    yield from _ends(destination)
