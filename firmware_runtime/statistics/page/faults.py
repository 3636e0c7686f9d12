"""What models reported as faults, by kind."""

from collections.abc import Iterator, Mapping
from typing import Any
from xml.etree.ElementTree import Element

from firmware_runtime.statistics.page.markup import element
from firmware_runtime.statistics.page.tables import table
from firmware_runtime.statistics.page.words import NOTHING

_HEAD = ("model", "kind", "times", "first", "last", "in words, the last time")


def faults_section(faults: Mapping[str, Any]) -> Iterator[Element]:
    """A row for each kind of fault of each model."""
    if not faults:
        yield element("p", "No model reported a fault.")
        return
    rows = (
        [
            path,
            kind,
            f"{counted['count']:,}",
            _instant(counted["first_s"]),
            _instant(counted["last_s"]),
            counted["last"],
        ]
        for path, kinds in faults.items()
        for kind, counted in kinds.items()
    )
    yield table("Faults that models reported", _HEAD, rows)


def _instant(at_s: float | None) -> str:
    return NOTHING if at_s is None else f"{at_s:.3f} s"
