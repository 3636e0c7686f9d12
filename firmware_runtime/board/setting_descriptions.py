"""Descriptions of settings: type, range and a sentence, as a board's schema declares them.

The sentence is the `Meta(description=...)` of the setting, or else the first line of its table's
docstring.
"""

from collections.abc import Iterator, Sequence
from typing import get_args, get_type_hints

from msgspec import Meta, Struct

from firmware_runtime.board.retuning import need_restart


class Setting(Struct, frozen=True):
    """One key of a board's settings; bounds are None where there are none."""

    type: str
    """bool, int, float or str."""
    text: str
    least: float | None = None
    most: float | None = None
    above: float | None = None
    """The value itself is outside of the range."""
    below: float | None = None

    @property
    def range(self) -> str:
        """The range in words, such as `above 0, 10 at most`; empty if there is none."""
        words = (
            (self.least, "from {:g}"),
            (self.above, "above {:g}"),
            (self.most, "{:g} at most"),
            (self.below, "below {:g}"),
        )
        return ", ".join(form.format(bound) for bound, form in words if bound is not None)


def described(settings: object, retunable: Sequence[str]) -> dict[str, Setting]:
    """The settings that may change while a robot runs, by their keys."""
    return {key: each for key, each in _below(settings, "") if not need_restart([key], retunable)}


def _below(settings: object, prefix: str) -> Iterator[tuple[str, Setting]]:
    if isinstance(settings, dict):
        for name, value in settings.items():
            yield from _below(value, f"{prefix}{name}.")
    if not isinstance(settings, Struct):
        return
    hints = get_type_hints(type(settings), include_extras=True)
    for name in settings.__struct_fields__:
        value = getattr(settings, name)
        if isinstance(value, Struct | dict):
            yield from _below(value, f"{prefix}{name}.")
        elif isinstance(value, bool | int | float | str):
            yield f"{prefix}{name}", _setting(type(settings), hints[name], value)


def _setting(table: type[Struct], hint: object, value: object) -> Setting:
    metas = list(_metas(hint))
    bounds = {
        ours: next((bound for meta in metas if (bound := getattr(meta, theirs)) is not None), None)
        for ours, theirs in (("least", "ge"), ("most", "le"), ("above", "gt"), ("below", "lt"))
    }
    stated = next((meta.description for meta in metas if meta.description), "")
    text = stated or (table.__doc__ or "").strip().partition("\n")[0]
    return Setting(type(value).__name__, text, **bounds)


def _metas(hint: object) -> Iterator[Meta]:
    yield from (each for each in getattr(hint, "__metadata__", ()) if isinstance(each, Meta))
    for inner in get_args(hint):
        yield from _metas(inner)
