"""Words and colours of diagrams: durations, names broken into lines, labels, the style sheet."""

from collections.abc import Sequence
from textwrap import wrap as wrapped
from typing import Final

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, SECOND
from firmware_runtime.models.state_table import Arrow
from firmware_runtime.view.diagram.canvas import FONT, Canvas, style_sheet

NAME_SIZE: Final = 13
_MARGIN: Final = 20
_UNITS: Final = (("s", SECOND), ("ms", MILLISECOND), ("us", MICROSECOND))
_STYLE: Final = style_sheet(
    f"""
  text {{ font-family: {FONT} }}
  .title {{ font-size: 16px; font-weight: bold }}
  .name {{ font-size: {NAME_SIZE}px; font-weight: bold }}
  .port, .note, .external-label, .internal-label {{ font-size: 11px }}
  .coupled, .inner {{ stroke-width: 1.2 }}
  .atomic, .state, .wire, .external, .internal, .start {{ stroke-width: 1.4 }}
  .wire, .external, .internal, .start {{ fill: none }}
  .internal {{ stroke-dasharray: 6 4 }}
  .wire:hover {{ stroke-width: 3.5 }}
  .halo {{ stroke-width: 4; stroke-linejoin: round; paint-order: stroke }}
""",
    (
        ("text, .start-head", "fill", "#1f2328", "#e6edf3"),
        (".paper, .atomic, .state", "fill", "#ffffff", "#0d1117"),
        (".halo", "stroke", "#ffffff", "#0d1117"),
        (".note", "fill", "#59636e", "#9198a1"),
        (".coupled", "fill", "#f6f8fa", "#151b23"),
        (".inner", "fill", "#eaeef2", "#212830"),
        (".coupled, .inner", "stroke", "#8c959f", "#656c76"),
        (".atomic, .state, .start", "stroke", "#424a53", "#b7bdc8"),
        (".wire, .external", "stroke", "#0550ae", "#79c0ff"),
        (".head, .external-head, .external-label", "fill", "#0550ae", "#79c0ff"),
        (".internal", "stroke", "#953800", "#ffa657"),
        (".internal-head, .internal-label", "fill", "#953800", "#ffa657"),
    ),
)


def diagram_text(canvas: Canvas, title: str) -> str:
    """The text of the SVG file, as large as what is drawn and a margin."""
    return canvas.svg(canvas.box(_MARGIN), title, _STYLE)


def duration_text(duration: int) -> str:
    """A time advance with the largest unit it reaches; the sign of infinity for never."""
    if duration == NEVER:
        return "\N{INFINITY}"
    for unit, size in _UNITS:
        if duration >= size:
            return f"{duration / size:g} {unit}"
    return f"{duration} ns"


def wrap(text: str, width: int) -> list[str]:
    """The words of a text in lines of at most `width` letters, as far as words allow."""
    return wrapped(text, width, break_long_words=False, break_on_hyphens=False)


def arrow_labels(arrows: Sequence[Arrow], width: int) -> list[str]:
    """The labels of arrows drawn as one, each after its condition."""
    lines: list[str] = []
    for arrow in arrows:
        if arrow.condition:
            lines.append(f"[{arrow.condition}]")
        lines += wrap(arrow.label, width)
    return lines
