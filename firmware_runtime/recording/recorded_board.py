"""Header of a recording, as far as it is of the board: settings, code and versions."""

from collections.abc import Iterable, Mapping
from typing import Any, Final, TypeAlias

from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.recording.code import code_of, digest_of
from firmware_runtime.recording.values import legible
from firmware_runtime.system.conditions import versions_here


class RecordedBoard(Struct, frozen=True, kw_only=True):
    """Header of a recording, as far as it is of the board, its settings and its code."""

    board: str
    """The board's own name."""
    kind: str
    fingerprint: str
    """SHA-256 over the board's file and the overrides."""
    source: str
    """The file that the settings came from."""
    table: dict[str, Any]
    """The board's settings, overrides included."""
    clock: str
    code: dict[str, str]
    """SHA-256 by module of the source of the recorded models' classes."""
    code_sha256: str
    """SHA-256 over those."""
    versions: dict[str, str | None]
    """Versions of Python, the kernel and packages."""


def recorded_board(board: Board, atomics: Iterable[Atomic], clock: Clock) -> RecordedBoard:
    """Return the header of a recording of these models."""
    code = code_of(atomics)
    return RecordedBoard(
        board=board.name,
        kind=board.kind,
        fingerprint=board.fingerprint,
        source=legible(str(board.source)),
        table=dict(board.table),
        clock=type(clock).__name__,
        code=code,
        code_sha256=digest_of(code),
        versions=versions_here(),
    )


Versions: TypeAlias = Mapping[str, str | None]
_APART: Final = {"kernel"}
"""Names of versions that compute nothing."""


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
