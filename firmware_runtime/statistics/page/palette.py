"""The colours of a report, each twice: on light paper and on dark."""

from typing import Final

_PAGE: Final = {
    "paper": ("#ffffff", "#0d1117"),
    "panel": ("#f6f8fa", "#151b23"),
    "line": ("#d1d9e0", "#30363d"),
    "ink": ("#1f2328", "#e6edf3"),
    "quiet": ("#59636e", "#9198a1"),
    "blue": ("#0969da", "#58a6ff"),
    "good": ("#1a7f37", "#3fb950"),
    "doubtful": ("#9a6700", "#d29922"),
    "bad": ("#cf222e", "#f85149"),
}
"""Paper, letters and lines."""
_PAINTS: Final = {
    "blue": _PAGE["blue"],
    "tint": ("#a9cdf7", "#1f4e8c"),
    "mean": ("#0a3069", "#e6edf3"),
    "late": ("#e3a008", "#d29922"),
    "skipped": ("#cf222e", "#f85149"),
    "waking": ("#d4a72c", "#d29922"),
    "behind": ("#bc4c00", "#db6d28"),
    "bus": ("#bc4c00", "#db6d28"),
    "garbage": ("#8250df", "#a371f7"),
    "rest": ("#afb8c1", "#484f58"),
    "colour0": ("#218bff", "#388bfd"),
    "colour1": ("#2da44e", "#3fb950"),
    "colour2": ("#a475f9", "#bc8cff"),
    "colour3": ("#1b7c83", "#39c5cf"),
    "colour4": ("#e85aad", "#f778ba"),
    "colour5": ("#6e7781", "#8b949e"),
    "colour6": ("#57ab5a", "#7ee787"),
    "colour7": ("#0550ae", "#79c0ff"),
    "wire0": ("#57606a", "#8b949e"),
    "wire1": ("#8c959f", "#c9d1d9"),
}
"""Colours that fill a shape, or a swatch of a legend, of a class of that name."""

PALETTE: Final = _PAGE | _PAINTS


def colours() -> str:
    """The palette as style sheet: variables for either scheme, and the classes of the paints.

    On paper it is always the light one.
    """
    light, dark = (
        "".join(f"--{name}: {pair[side]}; " for name, pair in PALETTE.items()) for side in (0, 1)
    )
    classes = "".join(
        f".{name} {{ fill: var(--{name}); color: var(--{name}); }}\n" for name in _PAINTS
    )
    return (
        f":root {{ color-scheme: light dark; {light}}}\n"
        f"@media screen and (prefers-color-scheme: dark) {{ :root {{ {dark}}} }}\n{classes}"
    )
