"""Results of the parts of a long campaign: kept with date, commit and conditions, as JSON."""

import math
import subprocess
import time
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, Protocol, Self, TypeVar

import msgspec
from msgspec import Struct

from benchmarks.shared.results import RESULTS, conditions

ROOT: Final = Path(__file__).parents[2]
BUILD: Final = ROOT / "build" / "reliability"
KEPT: Final = RESULTS / "reliability"


class Result(Struct, frozen=True, kw_only=True):
    """What came of one part: a sentence, its figures, and whether it is as it should be."""

    name: str
    summary: str
    is_sound: bool
    figures: Mapping[str, Any]
    is_read: bool = False
    """Whether it was read from what was measured before, or partly: how long it took is unknown."""


class Kept(Struct, frozen=True, kw_only=True):
    """A result, and when, of which code, and on what it was measured."""

    result: Result
    day: str
    commit: str
    load: float
    conditions: Mapping[str, Any]
    took_s: float


def ends_at(minutes: float | None) -> float:
    """The instant of the monotonic clock, s, after which no more is begun; without a limit none."""
    return math.inf if minutes is None else time.monotonic() + 60 * minutes


def keep(result: Result, took_s: float, folder: Path = KEPT) -> Path:
    """Write a result under its name."""
    found = conditions()
    kept = Kept(
        result=result,
        day=datetime.now(UTC).date().isoformat(),
        commit=commit(),
        load=found["load"],
        conditions={name: found[name] for name in ("kernel", "cpu", "cpu_count", "python")},
        took_s=round(took_s, 1),
    )
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{result.name}.json"
    path.write_bytes(msgspec.json.format(msgspec.json.encode(kept), indent=1) + b"\n")
    return path


def read_kept(name: str, folder: Path = KEPT) -> Kept | None:
    """Return what was kept of a part."""
    path = folder / f"{name}.json"
    return msgspec.json.decode(path.read_bytes(), type=Kept) if path.exists() else None


class Summed(Protocol):
    """Something that is measured in several runs, each by its name."""

    @property
    def name(self) -> str:
        """Return what it is of."""

    def after(self, earlier: Self) -> Self:
        """Return both together."""


S = TypeVar("S", bound=Summed)


def summed(earlier: Iterable[S], now: Sequence[S]) -> list[S]:
    """Return what was measured now, together with what was before."""
    before = {each.name: each for each in earlier}
    together = [each.after(before.pop(each.name)) if each.name in before else each for each in now]
    return [*before.values(), *together]


def in_order(*commits: str) -> str:
    """Return commits, each once, where each of these may be several."""
    return ", ".join(dict.fromkeys(each for some in commits for each in some.split(", ")))


def commit() -> str:
    """Return the commit that is measured, abbreviated."""
    words = ["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
