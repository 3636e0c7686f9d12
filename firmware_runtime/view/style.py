"""The style sheet of a report, and its colours, each twice: on light paper and on dark."""

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


_SHEET: Final = """
* { box-sizing: border-box; }
body {
  margin: 0; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", "DejaVu Sans", sans-serif;
  -webkit-print-color-adjust: exact; print-color-adjust: exact;
}
main { max-width: 62rem; margin: 0 auto; padding: 2rem 1.25rem 4rem; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .75rem; overflow-wrap: anywhere; }
h2 {
  font-size: 1.2rem; margin: 2.75rem 0 1rem; padding-bottom: .35rem;
  border-bottom: 1px solid var(--line);
}
h3 { font-size: .95rem; margin: 0 0 .4rem; overflow-wrap: anywhere; }
p { margin: .6rem 0; max-width: 50rem; overflow-wrap: anywhere; }
code { font: .9em/1.5 ui-monospace, "SF Mono", Menlo, "DejaVu Sans Mono", monospace; }
.quiet { color: var(--quiet); font-weight: normal; }

.verdict {
  display: inline-block; margin-right: .35rem; padding: .05rem .6rem; border-radius: 1rem;
  border: 1.5px solid currentColor;
}
.verdict.good { color: var(--good); }
.verdict.doubtful { color: var(--doubtful); }
.verdict.bad { color: var(--bad); }
.verdict.open { color: var(--quiet); }
.headline {
  max-width: none; padding: .6rem .8rem; background: var(--panel);
  border-left: 3px solid var(--blue); border-radius: 3px;
}
.figures {
  display: grid; grid-template-columns: repeat(auto-fit, minmax(9rem, 1fr)); margin: 1.25rem 0 0;
  background: var(--panel); border: 1px solid var(--line); border-radius: 6px; overflow: hidden;
}
.figures div {
  padding: .6rem .8rem; background: var(--paper); box-shadow: 0 0 0 1px var(--line);
}
.figures dt { color: var(--quiet); font-size: .8rem; }
.figures dd { margin: 0; font-size: 1.1rem; font-variant-numeric: tabular-nums; }
.glossary { display: grid; gap: .3rem; margin: 0; }
.glossary div { display: grid; grid-template-columns: 8rem 1fr; gap: .75rem; }
.glossary dt { font-weight: 600; }
.glossary dd { margin: 0; }
.refused {
  padding: .5rem .8rem; background: var(--panel); border-left: 3px solid var(--doubtful);
  border-radius: 3px;
}
.refused strong { color: var(--doubtful); }

figure { margin: 0 0 1.75rem; break-inside: avoid; min-width: 0; }
figcaption { font-weight: 600; margin-bottom: .5rem; overflow-wrap: anywhere; }
.frame { padding-left: 4.2rem; overflow-x: clip; }
.pairs {
  display: grid; grid-template-columns: repeat(auto-fit, minmax(min(24rem, 100%), 1fr));
  gap: 0 2rem; margin-top: 1.5rem;
}
.plot { display: block; overflow: visible; }
.plot text { font-size: 12px; fill: var(--ink); }
.plot .mark { fill: var(--quiet); font-size: 11.5px; }
.plot .marker-words, .plot .limit-words {
  font-weight: 600; paint-order: stroke; stroke: var(--paper); stroke-width: 4px;
  stroke-linejoin: round;
}
.plot .limit-words { fill: var(--doubtful); }
.grid { stroke: var(--line); }
.marker { stroke: var(--ink); }
.limit { stroke: var(--doubtful); stroke-width: 1.5; stroke-dasharray: 5 4; }
.bar { fill: var(--blue); stroke: var(--paper); stroke-width: .6; }
.column { shape-rendering: crispEdges; }
.lane { fill: var(--panel); }
.tick { stroke: currentColor; }
.line { stroke: currentColor; stroke-width: 2; }
.cap { stroke-width: 3; }
.segment { stroke: var(--paper); stroke-width: 1; }

.legend {
  display: flex; flex-wrap: wrap; gap: .15rem 1rem; margin: 0 0 .5rem; padding: 0;
  list-style: none; font-size: .85rem; font-variant-numeric: tabular-nums;
}
.legend li { overflow-wrap: anywhere; }
.swatch {
  display: inline-block; width: .75rem; height: .75rem; margin-right: .4rem; border-radius: 2px;
  vertical-align: -.06rem; background: currentColor;
}
.worst-list { list-style: none; margin: 0; padding: 0; }
.worst-list > li { margin-bottom: 1.4rem; break-inside: avoid; }
.worst-list .legend { margin: .1rem 0 0; }

.scroll { overflow-x: auto; margin: .2rem 0 1.25rem; }
table { border-collapse: collapse; font-size: .85rem; font-variant-numeric: tabular-nums; }
.caption { margin: .75rem 0 0; font-weight: 600; font-size: .9rem; }
th, td {
  padding: .3rem .9rem .3rem 0; text-align: left; vertical-align: top;
  border-bottom: 1px solid var(--line);
}
thead th { color: var(--quiet); font-weight: normal; white-space: nowrap; }
tbody th { font-weight: 600; white-space: nowrap; }
.numbers td { white-space: nowrap; }
.words td { min-width: 6rem; overflow-wrap: anywhere; }
summary { cursor: pointer; color: var(--quiet); font-size: .85rem; }
details[open] { padding-bottom: .5rem; }
:focus-visible { outline: 2px solid var(--blue); outline-offset: 2px; }

@media (max-width: 40rem) {
  main { padding: 1.25rem .9rem 3rem; }
  .glossary div { grid-template-columns: 1fr; gap: 0; }
}
@media print {
  main { max-width: none; padding: 0; }
  h2 { break-after: avoid; }
  .scroll { overflow: visible; }
  summary { display: none; }
}
"""

STYLE: Final = colours() + _SHEET
