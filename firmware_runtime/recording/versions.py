"""Which Python and which packages are others than in a recorded run."""

from collections.abc import Mapping
from typing import Final, TypeAlias

from firmware_runtime.system.conditions import versions_here

Versions: TypeAlias = Mapping[str, str | None]
_APART: Final = {"kernel"}
"""What computes nothing."""


def changed_versions(recorded: Versions) -> dict[str, dict[str, str | None]]:
    """By name, what was in the run (`recorded`) and what is `here`, where these differ.

    A package that was not looked for then is left out; None is one that is not installed.
    """
    here = versions_here()
    return {
        name: {"recorded": version, "here": here.get(name)}
        for name, version in recorded.items()
        if name not in _APART and version != here.get(name)
    }


def versions_said(changed: Mapping[str, Versions]) -> str:
    """All of them in a row: the name, what it was in the run, what it is here."""
    return ", ".join(
        f"{name} {each['recorded'] or 'none'} (here {each['here'] or 'none'})"
        for name, each in changed.items()
    )
