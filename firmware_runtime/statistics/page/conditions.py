"""The conditions a run took place under; what was asked of the system and refused comes first."""

from collections.abc import Mapping
from typing import Any
from xml.etree.ElementTree import Element

from firmware_runtime.statistics.page.markup import element
from firmware_runtime.statistics.page.tables import table
from firmware_runtime.statistics.page.words import plain
from firmware_runtime.statistics.refusals import refused

_NEEDS = "; needs "
"""How a reason tells what would fix it."""
_APART = ("run", "settings")


def conditions_section(conditions: Mapping[str, Any]) -> list[Element]:
    """What was refused, what was asked for, and everything else that is known."""
    return [
        *(_refusal(name, request) for name, request in refused(conditions).items()),
        _settings(conditions.get("settings", {})),
        table(
            "Conditions",
            ["condition", "value"],
            (
                [name.replace("_", " "), plain(value)]
                for name, value in conditions.items()
                if name not in _APART
            ),
            css="words",
        ),
    ]


def _refusal(name: str, request: Mapping[str, Any]) -> Element:
    reason, _, needs = str(request["reason"]).partition(_NEEDS)
    return element(
        "p",
        element("strong", "Not granted: "),
        element("code", f"{name} = {plain(request['asked'])}"),
        f". {reason}.",
        f" It takes {needs}." if needs else None,
        class_="refused",
    )


def _settings(settings: Mapping[str, Any]) -> Element:
    return table(
        "What the board asks of the system",
        ["setting", "asked", "granted"],
        (
            [name, plain(each["asked"]), "yes" if each["granted"] else plain(each["reason"])]
            for name, each in settings.items()
        ),
        css="words",
    )
