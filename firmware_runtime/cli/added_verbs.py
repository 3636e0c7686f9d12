"""Verbs of other packages, which may have any defect."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple

from firmware_runtime.board.installed import blamed_on, broken
from firmware_runtime.cli.main import Parser
from firmware_runtime.cli.verbs import OTHERS
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, Status
from firmware_runtime.system.packages import EntryPoint
from firmware_runtime.system.terminal import OutputError


def add_verb(entry_point: EntryPoint, verbs: Any) -> None:  # noqa: ANN401 -- argparse names it not
    """Add the verb that is called. Raises ConfigError for whatever is wrong with it."""
    with blamed_on(entry_point, "import"):
        module = entry_point.load()
    if not callable(getattr(module, "add_to", None)):
        found = f"{entry_point.value} has no add_to"
        raise broken(entry_point, f"{found}; expected a module with that function")
    with blamed_on(entry_point, "add_to"):
        module.add_to(verbs)


def add_sound_verb(entry_point: EntryPoint, verbs: Any) -> None:  # noqa: ANN401 -- as above
    """Add a verb that is not called: a broken one keeps no other from being carried out."""
    with suppress(ConfigError):
        add_verb(entry_point, verbs)


class Described(NamedTuple):
    """How `--help` shows a verb."""

    group: str
    summary: str


def described(entry_point: EntryPoint) -> Described | None:
    """What the verb's module says of itself, or its parser; None for a verb that is broken."""
    with suppress(ConfigError), blamed_on(entry_point, "import"):
        module = entry_point.load()
        group = getattr(module, "HELP_GROUP", OTHERS)
        if (summary := getattr(module, "HELP_LINE", None)) is None:
            verbs = Parser().add_subparsers()
            add_verb(entry_point, verbs)
            summary = "".join(each.description or "" for each in verbs.choices.values())
        return Described(str(group), str(summary))
    return None


def carried_out(entry_point: EntryPoint, execute: Callable[[], object]) -> int:
    """Call a verb and return its exit status. Raises ConfigError for a defect in it.

    What verbs may raise goes on as it is: errors of ours, a request to end, output without a place.
    """
    try:
        status = execute()
    except (FirmwareRuntimeError, SystemExit, BrokenPipeError, OutputError):
        raise
    except Exception:
        with blamed_on(entry_point, "execute"):
            raise
    if not isinstance(status, int | None):
        raise broken(entry_point, f"execute returned {status!r}; expected an exit status")
    return Status.OK if status is None else status
