"""Words in a picture: a duration as people say it, a name broken into lines, an arrow's label."""

from collections.abc import Sequence

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, SECOND
from firmware_runtime.models.state_table import Arrow

_UNITS = (("s", SECOND), ("ms", MILLISECOND), ("us", MICROSECOND))


def say_duration(duration: int) -> str:
    """A time advance with the largest unit it reaches; the sign of infinity for never."""
    if duration == NEVER:
        return "\N{INFINITY}"
    for unit, size in _UNITS:
        if duration >= size:
            return f"{duration / size:g} {unit}"
    return f"{duration} ns"


def wrap(text: str, width: int) -> list[str]:
    """The words of a text in lines of at most `width` letters, as far as words allow."""
    lines: list[str] = []
    for word in text.split():
        if lines and len(lines[-1]) + 1 + len(word) <= width:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return lines


def say_arrows(arrows: Sequence[Arrow], width: int) -> list[str]:
    """The labels of arrows drawn as one, each after its condition."""
    lines: list[str] = []
    for arrow in arrows:
        if arrow.condition:
            lines.append(f"[{arrow.condition}]")
        lines += wrap(arrow.label, width)
    return lines
