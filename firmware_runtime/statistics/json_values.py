"""Any value in JSON's types, as traces, sockets and results have it.

Numbers, texts, true, false and null are themselves; tuples, lists and numpy arrays are arrays;
named tuples, dataclasses, structs and dictionaries are objects; a member of an enumeration is its
name.
JSON has no word for numbers that are not finite: they are the texts "nan", "inf" and "-inf".
Anything else is the text that `str` makes of it.
"""

import math
from collections.abc import Iterable
from enum import Enum
from typing import Any, Final, cast

import msgspec

NOT_JSON: Final = (msgspec.MsgspecError, UnicodeError, RecursionError)
"""What msgspec's decoders raise for bytes that are no JSON, or MessagePack, of a type: beside their
own errors those of a text that UTF-8 has not, and of what is nested too deep."""


def plain(value: object) -> Any:  # noqa: ANN401 -- whatever JSON can say
    """The value in JSON's types."""
    to_list = getattr(value, "tolist", None)  # numpy's types have it; numpy takes long to import
    if to_list is not None:
        value = to_list()
    elif isinstance(value, Enum):
        value = value.name
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, int | str | None):
        return value
    named = _named(value)
    if named is not None:
        return {name: plain(each) for name, each in named}
    if isinstance(value, tuple | list):
        return [plain(each) for each in value]
    return str(value)


def is_json(word: str) -> bool:
    """Whether a word is a value in JSON; one that is none stands for itself."""
    try:
        msgspec.json.decode(word)
    except NOT_JSON:
        return False
    return True


def _named(value: object) -> Iterable[tuple[str, object]] | None:
    """Names and values of what becomes an object, else None."""
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return zip(value._fields, value, strict=True)
    if hasattr(value, "__dataclass_fields__") and not isinstance(value, type):
        from dataclasses import fields  # noqa: PLC0415 -- loaded already where there is one

        names = [field.name for field in fields(cast("Any", value))]
        return ((name, getattr(value, name)) for name in names)
    if isinstance(value, msgspec.Struct):
        return ((name, getattr(value, name)) for name in value.__struct_fields__)
    if isinstance(value, dict):
        return ((str(key), each) for key, each in value.items())
    return None
