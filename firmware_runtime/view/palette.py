"""The colours of all that is drawn, each twice: on light paper and on dark.

Those of curves are told apart by colour-blind people too (after Okabe and Ito), and each has enough
contrast with its paper.
"""

from typing import Final

PALETTE: Final = {
    "paper": ("#ffffff", "#0d1117"),
    "panel": ("#f6f8fa", "#151b23"),
    "line": ("#d1d9e0", "#30363d"),
    "ink": ("#1f2328", "#e6edf3"),
    "quiet": ("#59636e", "#9198a1"),
    "blue": ("#0969da", "#58a6ff"),
    "good": ("#1a7f37", "#3fb950"),
    "doubtful": ("#9a6700", "#d29922"),
    "bad": ("#cf222e", "#f85149"),
    "tint": ("#a9cdf7", "#1f4e8c"),
    "colour0": ("#0072b2", "#56b4e9"),
    "colour1": ("#b05a00", "#e69f00"),
    "colour2": ("#00795a", "#2ec4a0"),
    "colour3": ("#a8437f", "#e29ac4"),
    "colour4": ("#7a6a00", "#f0e442"),
    "colour5": ("#c23b00", "#ff7f50"),
    "colour6": ("#4b4b9b", "#a9a9f5"),
    "colour7": ("#59636e", "#b1bac4"),
    "behind": ("#bc4c00", "#db6d28"),
    "waking": ("#9a6700", "#d29922"),
    "garbage": ("#8250df", "#a371f7"),
    "rest": ("#6e7781", "#6e7681"),
    "wire0": ("#57606a", "#8b949e"),
    "wire1": ("#8c959f", "#c9d1d9"),
}
"""Paper, letters, judgements; curves; and what an activation spent its time on."""


def style_of_colours() -> str:
    """The palette as variables of a style sheet; on paper it is always the light one.

    A page whose root says `data-theme` is of that one, whatever the reader's system prefers.
    """
    light, dark = (
        "".join(f"--{name}:{pair[side]};" for name, pair in PALETTE.items()) for side in (0, 1)
    )
    return (
        f":root{{color-scheme:light dark;{light}}}\n"
        f"@media screen{{:root[data-theme=dark]{{color-scheme:dark;{dark}}}\n"
        f"@media (prefers-color-scheme:dark){{:root:not([data-theme=light]){{{dark}}}}}}}\n"
        ":root[data-theme=light]{color-scheme:light}\n"
    )
