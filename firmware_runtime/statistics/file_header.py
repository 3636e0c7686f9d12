"""What a run states once, before it begins, in the header of its statistics file."""

from math import isfinite
from typing import Annotated, Any

from msgspec import Meta, Struct, to_builtins

from firmware_runtime.devs.time import NEVER
from firmware_runtime.statistics.conditions import settings_of
from firmware_runtime.statistics.layout import Layout
from firmware_runtime.system.process_identity import ProcessIdentity


class StatedModel(Struct, frozen=True):
    """Of one model; one without a period has events."""

    period_ns: Annotated[int, Meta(gt=0)] | None
    tolerance_ns: int
    policy: str | None
    kind: str = ""


class Saved(Struct, frozen=True):
    """Of a copy: what held of the writer when it was made."""

    writer_alive: bool
    complete: bool


class Driver(Struct, frozen=True):
    """The part of a header that identifies the process: the guard needs no more."""

    writer: ProcessIdentity
    conditions: dict[str, Any]
    saved: Saved | None = None

    @property
    def has_outputs(self) -> bool:
        """Whether outputs outside its own process are switched off at its end."""
        return "switched_off" in self.conditions


class Header(Driver, frozen=True, kw_only=True):
    """The whole header, typed.

    `clock_speed` is how fast the run's clock goes, 0 for virtual time; None where what is due is
    not to be counted. `until_ns` is the instant at which the run is to end.
    """

    layout: Layout
    models: dict[str, StatedModel]
    clock_speed: float | None = None
    until_ns: int = NEVER
    began: tuple[int, int] | None = None
    """CLOCK_MONOTONIC and the system's time at the start, ns."""

    def __post_init__(self) -> None:
        """Refuse what cannot be used. Raises ValueError."""
        if not isfinite(self.clock_speed or 0):
            raise ValueError(f"clock_speed: {self.clock_speed}, expected a finite number")
        if missing := set(self.layout.models) - self.models.keys():
            raise ValueError(f"models: no entry for {', '.join(sorted(missing))}")
        settings_of(self.conditions)

    @property
    def board(self) -> str | None:
        """The name of the board, where it has one."""
        board = self.conditions.get("board")
        return None if board is None else str(board)

    def as_json(self) -> dict[str, Any]:
        """As the file carries it, with the place of every number."""
        table = {**to_builtins(self), "layout": self.layout.describe()}
        return {name: value for name, value in table.items() if value is not None}
