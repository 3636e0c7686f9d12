"""What the words of a report mean, and how its page came about."""

from collections.abc import Iterator, Mapping
from importlib.metadata import version
from typing import Any
from xml.etree.ElementTree import Element

from firmware_runtime.statistics.page.markup import element

_WORDS = {
    "lateness": "from an activation's deadline to the start of its output function",
    "late": "an activation that ran, but began later than its model tolerates",
    "skipped": "due, and dropped: by policy, or because the run ended before its turn",
    "coalesced": "due by the clock, but an earlier event made the model plan anew",
    "own time": "what a model's own functions took in a step; the steps' own times add up",
    "waking": "from the deadline, or the end of the step before, to the start of this step",
    "steps before": "from the deadline to the end of the step before: our own steps took too long",
    "bus time": "time on the wire, computed from bits and bus speed; doubles answer sooner",
    "p99": "99 % of all samples did not take longer; never too low, at most 3.1 % too high",
}


def glossary(numbers: Mapping[str, Any]) -> Iterator[Element]:
    """The words, then where the page and its numbers come from."""
    pairs = (
        element("div", element("dt", word), element("dd", meaning))
        for word, meaning in _WORDS.items()
    )
    yield element("dl", *pairs, class_="glossary")
    made = f"firmware-runtime {version('firmware-runtime')}"
    ran = numbers["conditions"].get("versions", {}).get("firmware-runtime")
    yield element(
        "p",
        f"Made by {made} from a copy of the run's statistics file (schema {numbers['schema']})",
        f", which firmware-runtime {ran} had written" if ran else None,
        ". Making it changed nothing in that file; equal statistics make an equal page. ",
        "The page holds all it needs and asks nothing of any network.",
        class_="quiet",
    )
