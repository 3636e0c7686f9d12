"""Faults that were made on served doubles, as a pytest file with a script of them.

The script is run before it is written: the test asserts that the robot notices if it did then.
"""

from pathlib import Path
from typing import Final

from msgspec import Struct

from firmware_runtime.board.assignments import assigned
from firmware_runtime.board.installed import names
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.served.packets import FaultList
from firmware_runtime.hal.strike import KINDS, Strike, Struck
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.runs.fault_test import FaultTest, quoted, set_source
from firmware_runtime.runs.open_board import OpenBoard, open_board
from sim_doubles.testing.broken import noticed

_AFTERWARDS_S: Final = 3.0
NOT_MADE_SAFE: Final = "not made safe"
"""Words of a run that ends with an output it cannot reach."""
_IMPORTED: Final = """from firmware_runtime import Strike, open_board
from sim_doubles.testing.broken import {}"""
_IMPORTED_UNSAFE: Final = """import pytest

from firmware_runtime import HalError, Strike, open_board"""


class Script(Struct, frozen=True):
    """A board, and the faults of a run on it."""

    board: str
    """Its name, or the path of its settings."""
    settings: dict[str, object]
    faults: list[Strike]
    for_s: float
    """How long the run is to go on: beyond the last of them."""

    def opened(self) -> OpenBoard:
        """Open the robot with them, in virtual time."""
        return open_board(
            self.board, doubles=True, clock="virtual", set=self.settings, faults=self.faults
        )


def script_of(listing: FaultList) -> Script:
    """The faults of the run that is under way on doubles, or was the last.

    Instants are those since its first transaction. Raises ConfigError where there are none.
    """
    if listing.source is None:
        raise ConfigError.of_one("--as-test", "chips without a board", "the doubles of a board")
    if listing.began_at is None:
        raise ConfigError.of_one("--as-test", "no robot was run on these doubles", "a run")
    began = listing.began_at
    faults = [_since(began, each) for each in listing.struck if _end(each, listing.at) >= began]
    if not faults:
        raise ConfigError.of_one("--as-test", "nothing was broken in this run", "some fault")
    for_s = max(each.at_s + (each.for_s or 0.0) for each in faults) + _AFTERWARDS_S
    return Script(
        listing.board if listing.board in names() else listing.source,
        dict(map(assigned, listing.assignments)),
        faults,
        round(for_s, 3),
    )


def what_is_noticed(script: Script) -> str | None:
    """Run a script; return what the robot does about it, in words, None for nothing.

    Raises what `open_board` and a run raise, but for an end that is not safe, which is an answer.
    """
    robot = script.opened()
    try:
        robot.run(script.for_s)
        return noticed(robot)
    except HalError as error:
        if not str(error).startswith(NOT_MADE_SAFE):
            raise
        return str(error)
    finally:
        robot.clear_faults()
        robot.close()


def text_of_test(script: Script, name: str, noticed: str | None) -> str:
    """The source of a test of a script, and of what is noticed."""
    run = f"robot.run({script.for_s})"
    if noticed is not None and noticed.startswith(NOT_MADE_SAFE):
        imported = _IMPORTED_UNSAFE
        lines = [f'with pytest.raises(HalError, match="{NOT_MADE_SAFE}"):', f"    {run}"]
    else:
        asserted = ["assert_noticed"] * (noticed is not None) + ["assert_ends_off"]
        imported = _IMPORTED.format(", ".join(sorted(asserted)))
        lines = [run, *(f"{each}(robot)" for each in asserted)]
    opened = f'{quoted(script.board)}, doubles=True, clock="virtual"{set_source(script.settings)}'
    test = FaultTest(
        name=name,
        title=f"{Path(script.board).name} as it was broken on its doubles.",
        about="Written by `firmware-runtime doubles fault --as-test`.",
        imported=imported,
        faults=script.faults,
        body=[f"with open_board({opened}, faults=FAULTS) as robot:", *(f"    {e}" for e in lines)],
    )
    return test.text()


def _end(struck: Struck, now: int) -> int:
    return now if struck.span is None else struck.at + struck.span


def _since(began: int, struck: Struck) -> Strike:
    """A fault by an instant of the run; what was there when that began is there from its start."""
    at = max(0, struck.at - began)
    left = None if struck.span is None else struck.at + struck.span - began - at
    for_s = None if left is None or KINDS[struck.kind].is_moment else _in_s(left)
    return Strike(struck.kind, struck.device, _in_s(at), for_s, struck.amount)


def _in_s(span: int) -> float:
    """Seconds, to the millisecond."""
    return round(span / MILLISECOND) * MILLISECOND / SECOND
