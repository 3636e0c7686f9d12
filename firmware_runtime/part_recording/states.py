"""The state of atomic models as fields: path, a dot, the attribute; its value as bytes.

The state of an atomic is its plain attributes, phase and sigma among them. Ports, names, functions
and what leads to other models are none of it. An object of a class of its own counts by its
attributes, and by the name of its class.
"""

from collections.abc import Iterable, Iterator
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.ports import InPort, OutPort, Owner
from firmware_runtime.recording.values import UnknownValue, encoded, legible

_FRAME: Final = frozenset({"name", "parent", "in_ports", "out_ports"})
_NO_STATE: Final = (InPort, OutPort, Owner)
_DEPTH: Final = 3
_IMMUTABLE: Final = frozenset({type(None), bool, int, float, str, bytes})


class States:
    """The fields of some models, and which of them have changed since they were read last.

    An object of an immutable type that is the same as before is not looked into again.
    """

    def __init__(self, atomics: Iterable[Atomic]) -> None:
        self._atomics = [(below_root(each.path), each, _Seen()) for each in atomics]

    def changed(self) -> dict[str, bytes]:
        """Fields whose value is another than at the last call; all of them at the first."""
        changed: dict[str, bytes] = {}
        for path, atomic, seen in self._atomics:
            for name, value in vars(atomic).items():
                known = seen.get(name)
                if known is not None and value is known[0] and known[2]:
                    continue
                if name in _FRAME or isinstance(value, _NO_STATE) or callable(value):
                    seen[name] = (value, b"", True)
                    continue
                content = _content(value, _DEPTH)
                if known is None or content != known[1]:
                    changed[f"{path}.{name}"] = content
                seen[name] = (value, content, _is_immutable(value))
        return changed


_Seen: TypeAlias = dict[str, tuple[object, bytes, bool]]
"""By attribute: its value, that as bytes, and whether it stays so while it is the same object."""


def _is_immutable(value: Any) -> bool:  # noqa: ANN401 -- any object
    kind = type(value)
    parameters = getattr(kind, "__dataclass_params__", None)
    return kind in _IMMUTABLE or (parameters is not None and parameters.frozen)


def _content(value: object, depth: int) -> bytes:
    try:
        return encoded(value)
    except UnknownValue:
        kind = type(value)
        return encoded((kind.__module__, kind.__qualname__, tuple(_inside(value, depth))))


def _inside(value: Any, depth: int) -> Iterator[object]:  # noqa: ANN401 -- any object
    """The attributes of an object, or the items of a container, so many levels deep."""
    if depth == 0 or isinstance(value, _NO_STATE) or callable(value):
        return
    if isinstance(value, dict):
        parts: Iterable[tuple[object, object]] = list(value.items())
    elif isinstance(value, list | tuple):
        parts = list(enumerate(value))
    elif isinstance(value, set | frozenset):  # texts in a set have another order in every process
        yield from sorted(_content(each, depth - 1) for each in value)
        return
    else:
        parts = list(getattr(value, "__dict__", {}).items())
    for name, part in parts:
        yield legible(str(name)), _content(part, depth - 1)
