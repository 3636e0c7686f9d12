"""Values as a link carries them: MessagePack, by the type of their port, exact to the bit.

    type                                   in MessagePack
    None, bool, int, float, str, bytes     itself; a whole number in a port of float stays one
    an enumeration                         the name of its member
    a named tuple, dataclass or struct     an array of its fields, in order
    tuple[float, ...], list[int]           an array
    dict[str, float]                       a map
    float | None                           itself; other unions: [number of the member, value]
    numpy's NDArray                        extension 2: [dtype, shape, bytes]
    a whole number beyond 64 bits          extension 3: its digits
    of a subclass of the declared type     extension 1: [name of the class, value]

Every number in what arrives is checked before anything is made of it (`forms`).
"""

from collections.abc import Iterator, Sequence
from math import isfinite

from msgspec.msgpack import Ext

from firmware_runtime.links.cut.forms import ARRAY, LARGE, array_of, decode, encode, form_of
from firmware_runtime.links.cut.refusal import Reason, Refused


class Packing:
    """Packs and unpacks the values of a port of this type.

    `text` describes the type down to its last field: two ends with the same text carry the same.
    Raises TypeError for a type that does not say what it is made of.
    """

    def __init__(self, kind: object) -> None:
        self._form = form_of(kind)
        self.text = self._form.text

    def pack_all(self, values: Sequence[object]) -> bytes:
        """The bytes of values, as an array. Raises TypeError for one that is not of the type."""
        return encode([self._form.pack(value) for value in values])

    def unpack_all(self, packed: bytes, limits: tuple[float, float] | None = None) -> list[object]:
        """The values of an array of one or more, every number finite and within the limits.

        Bytes come from outside, and classes from any package: whatever they raise is Refused.
        """
        try:
            found = _checked(packed, limits)
            if not isinstance(found, list) or not found:
                raise Refused(Reason.MALFORMED, "no array of values")  # noqa: TRY301
            return [self._form.unpack(each) for each in found]
        except Refused:
            raise
        except Exception as error:
            raise Refused(Reason.MALFORMED, str(error) or type(error).__name__) from error


def _checked(packed: bytes, limits: tuple[float, float] | None) -> object:
    """What MessagePack bears. Raises Refused for a number in it that is none, or too large."""
    found = decode(packed)
    for number in _numbers(found):
        _check(number, limits)
    return found


def _check(number: float, limits: tuple[float, float] | None) -> None:
    """Raises Refused."""
    if not isfinite(number):
        raise Refused(Reason.NOT_FINITE, f"{number}: expected a finite number")
    if limits is not None and not limits[0] <= number <= limits[1]:
        expected = f"expected {limits[0]:g} to {limits[1]:g}"
        raise Refused(Reason.OUT_OF_LIMITS, f"{number:g}: {expected}")


def _numbers(found: object) -> Iterator[float]:
    """Every number in what MessagePack bears, at any depth; true and false are none."""
    if isinstance(found, float) or type(found) is int:
        yield found
    elif isinstance(found, list):
        for each in found:
            yield from _numbers(each)
    elif isinstance(found, dict):
        yield from _numbers(list(found.values()))
    elif isinstance(found, Ext):
        yield from _numbers_of_extension(found)


def _numbers_of_extension(found: Ext) -> Iterator[float]:
    if found.code == ARRAY:
        yield from array_of(found).ravel().tolist()
    elif found.code == LARGE:
        yield int(bytes(found.data))
    else:
        yield from _numbers(decode(bytes(found.data)))
