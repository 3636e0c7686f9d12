"""Values of a declared type, as other processes write them: the one codec of ports and of links.

    declared type                          JSON (ports)             MessagePack (links)
    None, bool, float, str                 the same                 the same; in a float also int
    int                                    the same, of 64 bits     beyond 64 bits: extension 3
    an enumeration                         the name of its member   the same
    a named tuple, dataclass or struct     an object of its fields  an array of them, in order
    tuple[float, ...], list[int]           an array                 an array
    dict[str, float]                       an object                a map
    float | None                           null, or the value       the same
    other unions                           the first that fits      [number of the member, value]
    Literal["up", "down"]                  one of these             as a union of their types
    bytes                                  -                        the same
    numpy's NDArray                        -                        extension 2
    a subclass of the declared type        -                        extension 1

Extension 1 is `[class, value]`, 2 `[dtype, shape, bytes]`, 3 the digits. In JSON a field with
a default may be left out, a float may be written 1, and limits that a type states by `Meta` are
kept; in MessagePack values come out as they went in, exact to the bit.

Everything is read by the declared types, down to the last field. A type that leaves open what is
in it (`tuple`, `object`) is not carried. Only classes that this process has already, and that are
subclasses of the declared one, are ever made of what arrives.
"""

import json
from collections.abc import Callable
from enum import Enum
from functools import partial
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Final,
    Literal,
    TypeAlias,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import msgspec
from msgspec.msgpack import Ext

from firmware_runtime.errors import with_article
from firmware_runtime.links.leaf_values import (
    PLAIN,
    REQUIRED,
    SUBCLASS,
    Form,
    any_of,
    array_of,
    class_name,
    decode,
    default_text,
    encode,
    field_defaults,
    first_that_fits,
    is_array,
    is_record,
    pack_array,
    pack_int,
    same,
    subclass_named,
    unpack_int,
    unpack_number,
    unpack_plain,
)

_WIDENED: Final = {(int, float), (bool, int), (bool, float)}
"""Python's own subclasses, or what it takes for them: they are carried as they are."""

Hint: TypeAlias = Any
"""A class, or what `typing` makes of some."""


class _Codec:
    """Makes the form of each type, for JSON as people write it or for MessagePack as links do."""

    def __init__(self, *, in_json: bool) -> None:
        self._in_json = in_json
        self._known: dict[Hint, Form] = {}
        self._known_exactly: dict[type[Any], Form] = {}

    def form_of(self, kind: Hint) -> Form:
        """Return the form of a type. Raises TypeError for one that leaves open what is in it."""
        if kind not in self._known:
            self._known[kind] = self._new_form(kind)
        return self._known[kind]

    def _new_form(self, kind: Hint) -> Form:
        origin: Hint = get_origin(kind)
        parts = get_args(kind)
        if type(origin or kind).__name__ == "TypeAliasType":  # `type Name = ...`, numpy's NDArray
            return self.form_of((origin or kind).__value__)
        if is_array(origin or kind) and not self._in_json:
            return Form("array", pack_array, array_of)
        if origin in _GENERIC and parts:
            return _GENERIC[origin](self, parts)
        if isinstance(kind, type) and not parts:
            return self._exact(kind) if self._in_json else self._with_subclasses(kind)
        raise TypeError(f"{kind}: it does not say what it is made of")

    def _with_subclasses(self, kind: type[Any]) -> Form:
        """Return the form of a class, whose subclasses go by their own names."""
        own = self._exact(kind)

        def pack(value: object) -> object:
            found = type(value)
            if found is kind:
                return own.pack(value)
            if (found, kind) in _WIDENED:
                return self._exact(found).pack(value)
            if issubclass(found, kind):
                return Ext(SUBCLASS, encode([class_name(found), self._exact(found).pack(value)]))
            raise TypeError(f"{value!r}: not {with_article(kind.__name__)}")

        def unpack(found: object) -> object:
            if isinstance(found, Ext) and found.code == SUBCLASS:
                name, inner = decode(bytes(found.data))
                return self._exact(subclass_named(kind, name)).unpack(inner)
            return found if (type(found), kind) in _WIDENED else own.unpack(found)

        return Form(own.text, pack, unpack)

    def _exact(self, kind: type[Any]) -> Form:
        """Return the form of instances of this very class."""
        if kind not in self._known_exactly:
            self._known_exactly[kind] = self._new_exact(kind)
        return self._known_exactly[kind]

    def _new_exact(self, kind: type[Any]) -> Form:
        if kind is int:
            return Form("int", pack_int, partial(unpack_int, in_json=self._in_json))
        if kind is float and self._in_json:
            return Form("float", same, unpack_number)
        if kind in PLAIN and not (kind is bytes and self._in_json):
            name = "null" if kind is NoneType else kind.__name__
            return Form(name, same, partial(unpack_plain, kind))
        if issubclass(kind, Enum):
            return self._enumeration(kind)
        if is_record(kind):
            return self._record(kind)
        base: Hint = next((each for each in kind.__mro__ if each in PLAIN), None)
        if base is None or self._in_json:
            raise TypeError(f"{kind.__name__}: it does not say what it is made of")
        plain = self._exact(base)  # of a class such as numpy's float64, which is a float
        return Form(
            kind.__name__,
            lambda value: plain.pack(base(value)),
            lambda found: kind(plain.unpack(found)),
        )

    def _enumeration(self, kind: type[Enum]) -> Form:
        def unpack(found: object) -> Enum:
            if not isinstance(found, str) or found not in kind.__members__:
                raise ValueError(f"{found!r:.40}: expected {text}")
            return kind[found]

        text = any_of(kind.__members__)
        return Form(self._named(kind, text), lambda value: value.name, unpack)

    def _record(self, kind: type[Any]) -> Form:
        """Return the form of a named tuple, dataclass or struct."""
        hints, defaults = get_type_hints(kind, include_extras=True), field_defaults(kind)
        forms = {name: self.form_of(hints[name]) for name in defaults}

        def pack(value: object) -> object:
            return [form.pack(getattr(value, name)) for name, form in forms.items()]

        def unpack_array(found: list[Any]) -> object:
            made = zip(forms.items(), unpack_plain(list, found), strict=True)
            return kind(**{name: form.unpack(each) for (name, form), each in made})

        def unpack_object(found: object) -> object:
            made = {}
            for name, each in unpack_plain(dict, found).items():
                if name not in forms:
                    raise ValueError(f"{name}: unknown field")
                try:
                    made[name] = forms[name].unpack(each)
                except Exception as error:
                    raise ValueError(f"{name}: {error}") from error
            for name, default in defaults.items():
                if default is REQUIRED and name not in made:
                    raise ValueError(f"{name}: missing")
            return kind(**made)

        shown = {
            name: default_text(each) if self._in_json else "" for name, each in defaults.items()
        }
        texts = [f"{json.dumps(name)}: {form.text}{shown[name]}" for name, form in forms.items()]
        unpack = unpack_object if self._in_json else unpack_array
        return Form(self._named(kind, f"{{{', '.join(texts)}}}"), pack, unpack)

    def _named(self, kind: type[Any], text: str) -> str:
        """Return the text of a form; two ends of a link agree on the class that it makes, too."""
        return text if self._in_json else f"{kind.__name__}({text})"

    def tuple_(self, parts: tuple[Hint, ...]) -> Form:
        """Return the form of `tuple[...]`."""
        if parts[-1] is ...:
            return self.sequence(tuple, parts[0])
        forms = [self.form_of(part) for part in parts]
        return Form(
            self._named(tuple, f"[{', '.join(form.text for form in forms)}]"),
            lambda value: [form.pack(each) for form, each in zip(forms, value, strict=True)],
            lambda found: tuple(
                form.unpack(each)
                for form, each in zip(forms, unpack_plain(list, found), strict=True)
            ),
        )

    def sequence(self, kind: type[list[Any]] | type[tuple[Any, ...]], part: Hint) -> Form:
        """Return the form of `list[...]` and of `tuple[..., ...]`."""
        form = self.form_of(part)
        return Form(
            self._named(kind, f"[{form.text}, ...]"),
            lambda value: [form.pack(each) for each in value],
            lambda found: kind(map(form.unpack, unpack_plain(list, found))),
        )

    def map_(self, parts: tuple[Hint, ...]) -> Form:
        """Return the form of `dict[str, ...]`."""
        if parts[0] is not str:
            raise TypeError(f"dict[{parts[0].__name__}, ...]: expected texts as keys")
        form = self.form_of(parts[1])
        return Form(
            f"{{str: {form.text}}}",
            lambda value: {name: form.pack(each) for name, each in value.items()},
            lambda found: {
                unpack_plain(str, name): form.unpack(each)
                for name, each in unpack_plain(dict, found).items()
            },
        )

    def union(self, parts: tuple[Hint, ...]) -> Form:
        """Return the form of one of several types; with None as the only other, the value's own."""
        forms = [self.form_of(part) for part in parts if part is not NoneType]
        has_none, is_alone = NoneType in parts, len(forms) == 1
        text = " | ".join(self.form_of(part).text for part in parts)

        def pack(value: object) -> object:
            if value is None and has_none:
                return None
            if is_alone:
                return forms[0].pack(value)
            for number, form in enumerate(forms):
                try:
                    return [number, form.pack(value)]
                except (TypeError, AttributeError, ValueError):
                    continue
            raise TypeError(f"{value!r}: not {with_article(text)}")

        def unpack(found: Any) -> object:  # noqa: ANN401 -- what was decoded
            if found is None and has_none:
                return None
            if is_alone:
                return forms[0].unpack(found)
            if self._in_json:
                return first_that_fits(forms, found)
            number, inner = found
            return forms[number].unpack(inner)

        return Form(text, pack, unpack)

    def literal(self, parts: tuple[object, ...]) -> Form:
        """Return the form of `Literal[...]`."""
        if not self._in_json:
            return self.union(tuple(dict.fromkeys(map(type, parts))))
        text = any_of(parts)

        def unpack(found: object) -> object:
            if not any(type(found) is type(part) and found == part for part in parts):
                raise ValueError(f"{found!r:.40}: expected {text}")
            return found

        return Form(text, same, unpack)

    def annotated(self, parts: tuple[Any, ...]) -> Form:
        """Return the form of `Annotated[...]`; its limits count in JSON."""
        form, limits = self.form_of(parts[0]), [p for p in parts if isinstance(p, msgspec.Meta)]
        if not (self._in_json and limits):
            return form
        base = {tuple: list}.get(get_origin(parts[0]), get_origin(parts[0]) or parts[0])
        limited: Any = Annotated[(base, *limits)]

        def unpack(found: object) -> object:
            msgspec.convert(found, limited)
            return form.unpack(found)

        return form._replace(unpack=unpack)


_GENERIC: Final[dict[Hint, Callable[[_Codec, tuple[Any, ...]], Form]]] = {
    Annotated: _Codec.annotated,
    Literal: _Codec.literal,
    Union: _Codec.union,
    UnionType: _Codec.union,
    tuple: _Codec.tuple_,
    list: lambda codec, parts: codec.sequence(list, parts[0]),
    dict: _Codec.map_,
}
"""By what a hint is made from."""

json_form: Final = _Codec(in_json=True).form_of
packed_form: Final = _Codec(in_json=False).form_of
