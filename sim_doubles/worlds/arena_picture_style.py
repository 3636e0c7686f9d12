"""The style of the picture of a run: shapes and colours, for light and dark."""

from collections.abc import Iterator, Mapping
from typing import Final

from firmware_runtime.view.canvas import FONT, style_sheet

__all__ = ["HUES", "STYLE"]

HUES: Final = 7
"""Number of colours for states, classes `hue0` and on; `hue-brief` is for the rest."""

_COLOURS: Final[Mapping[str, tuple[str, str, str]]] = {
    ".paper": ("fill", "#ffffff", "#0d1117"),
    "text": ("fill", "#1f2328", "#e6edf3"),
    ".note": ("fill", "#59636e", "#9198a1"),
    ".grid": ("stroke", "#e7eaee", "#20262e"),
    ".frame": ("stroke", "#8c959f", "#656c76"),
    ".obstacle": ("fill", "#afb8c1", "#484f58"),
    ".wall": ("stroke", "#6e7781", "#8b949e"),
    ".target": ("fill", "#cf222e", "#f85149"),
    ".goal": ("stroke", "#cf222e", "#f85149"),
    ".goal-zone": ("fill", "#cf222e", "#f85149"),
    ".sweep": ("fill", "#5b84b1", "#79a6d8"),
    ".radar": ("fill", "#0a7ea4", "#39c5cf"),
    ".radar-edge": ("stroke", "#0a7ea4", "#39c5cf"),
    ".body": ("fill", "#d4870b", "#e3b341"),
    ".body-edge": ("stroke", "#d4870b", "#e3b341"),
    ".vehicle": ("stroke", "#1f2328", "#e6edf3"),
    ".solid": ("fill", "#ffffff", "#0d1117"),
    ".nose": ("fill", "#1f2328", "#e6edf3"),
    ".line": ("stroke", "#1f2328", "#e6edf3"),
    ".on-hue": ("fill", "#ffffff", "#0d1117"),
    ".hue0": ("--hue", "#3b6fd4", "#6ea8ff"),
    ".hue1": ("--hue", "#8250df", "#b392f0"),
    ".hue2": ("--hue", "#2a8a52", "#56d383"),
    ".hue3": ("--hue", "#b5487f", "#f29bc1"),
    ".hue4": ("--hue", "#7d6236", "#d1b27a"),
    ".hue5": ("--hue", "#5d8223", "#a5d25c"),
    ".hue6": ("--hue", "#6a737d", "#a2abb5"),
    ".hue-brief": ("--hue", "#1f2328", "#e6edf3"),
}
"""Colours by class: property, light, dark."""

_SHAPES: Final = f"""
  text {{ font: 12px {FONT} }}
  .title {{ font-size: 18px; font-weight: bold }}
  .small {{ font-size: 11px }}
  .grid, .frame, .wall, .goal, .vehicle, .line, .path, .edge {{ fill: none }}
  .frame {{ stroke-width: 1 }}
  .wall {{ stroke-width: 4; stroke-linecap: round }}
  .low {{ opacity: 0.55 }}
  .goal {{ stroke-width: 1.2; stroke-dasharray: 5 4 }}
  .goal-zone {{ opacity: 0.08 }}
  .sweep {{ opacity: 0.13 }}
  .beam {{ opacity: 0.30 }}
  .edge {{ stroke-width: 2.6; stroke-linecap: round }}
  .path {{ stroke-width: 3.2; stroke-linecap: round; stroke-linejoin: round }}
  .vehicle {{ stroke-width: 1.6 }}
  .ghost {{ opacity: 0.40 }}
  .line {{ stroke-width: 1.6; stroke-linejoin: round }}
"""


def _rules() -> Iterator[tuple[str, str, str, str]]:
    """The colours as rules; a hue fills, or draws what is a path."""
    for css, (what, light, dark) in _COLOURS.items():
        if what == "--hue":
            yield css, "fill", light, dark
            yield f".path{css}", "stroke", light, dark
        else:
            yield css, what, light, dark


STYLE: Final = style_sheet(_SHAPES, list(_rules()))
