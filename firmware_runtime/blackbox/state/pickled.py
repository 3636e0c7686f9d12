"""The pickle of a state: written with the known objects in the memo, read with stand-ins for them.

Reading calls nothing but `Value`, which holds what it is given; a stream that names anything else
is refused.
"""

import io
import pickle
import struct
from collections.abc import Callable, Sequence
from typing import Any, Final, Never

from firmware_runtime.blackbox.state.later import Known, NoValue, Value, reduced
from firmware_runtime.blackbox.state.layouts import Thing

PROTOCOL: Final = 5
_PROTO: Final = pickle.PROTO + bytes([PROTOCOL])
_LAID_DOWN: Final = pickle.MEMOIZE + pickle.POP
_VALUE: Final = -1
"""In place of a number: the class `Value` itself."""


class StateWriter:
    """Writes states of a robot; `things` and `names` go into them as numbers.

    `part_of` says of which known memoryview another one is a part.
    """

    def __init__(
        self,
        things: Sequence[Thing],
        names: Sequence[str],
        part_of: Callable[[memoryview], tuple[object, ...]],
    ) -> None:
        self._content = io.BytesIO()
        self._primed = _Pickler(io.BytesIO(), PROTOCOL)
        self._primed.memo = {
            id(each): (place, each) for place, each in enumerate((Value, *things, *names))
        }
        self._pickler = _Pickler(self._content, PROTOCOL)
        self._pickler.part_of = part_of

    def written(self, state: object) -> bytes:
        """The state as bytes. Raises NoValue for an object in it that has no value."""
        content, pickler = self._content, self._pickler
        content.seek(0)
        content.truncate()
        pickler.memo = self._primed.memo
        try:
            pickler.dump(state)
        except RecursionError:
            raise NoValue("objects within objects, too deep to be written") from None
        finally:
            pickler.memo = self._primed.memo  # lets go of the objects that it has just written
        return content.getvalue()


class _Pickler(pickle.Pickler):
    part_of: Callable[[memoryview], tuple[object, ...]]

    def reducer_override(self, thing: Thing) -> tuple[Any, ...]:
        if type(thing) is memoryview:
            return Value, ("view", None), self.part_of(thing)
        return reduced(thing)


class StateReader:
    """Reads what a `StateWriter` of an equal robot has written."""

    def __init__(self, things: int, names: Sequence[str]) -> None:
        numbers = (
            pickle.BININT + struct.pack("<i", number) + pickle.BINPERSID + _LAID_DOWN
            for number in range(_VALUE, things)
        )
        texts = (name.encode("utf-8", "surrogatepass") for name in names)
        written = (
            pickle.BINUNICODE + struct.pack("<I", len(text)) + text + _LAID_DOWN for text in texts
        )
        self._memo = b"".join((_PROTO, *numbers, *written))

    def read(self, content: bytes) -> Thing:
        """The state, with `Known` and `Value` in it. Raises NoValue for anything else."""
        try:
            return _Unpickler(io.BytesIO(self._memo + content)).load()
        except NoValue:
            raise
        except Exception as error:  # whatever stands in a file
            raise NoValue(f"{type(error).__name__}: {error}") from error


class _Unpickler(pickle.Unpickler):
    def persistent_load(self, number: object) -> object:
        if not isinstance(number, int):
            raise NoValue(f"{number!r:.40}; expected the number of an object")
        return Value if number == _VALUE else Known(number)

    def find_class(self, module: str, name: str) -> Never:
        raise NoValue(f"{module}.{name}; expected no class and no function")
