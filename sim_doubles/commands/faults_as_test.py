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
from firmware_runtime.runs.open_board import OpenBoard, open_board
from sim_doubles.testing.broken import noticed

_AFTERWARDS_S: Final = 3.0
_TEST = '''"""{board} as it was broken on its doubles.

Written by `firmware-runtime doubles fault --as-test`.
"""

from firmware_runtime import Strike, open_board
from sim_doubles.testing.broken import {imported}

FAULTS = [
{faults}
]


def {name}() -> None:
    with open_board({opened}, faults=FAULTS) as robot:
        robot.run({for_s})
{asserted}
'''


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

    Raises what `open_board` and a run raise.
    """
    robot = script.opened()
    try:
        robot.run(script.for_s)
        return noticed(robot)
    finally:
        robot.clear_faults()
        robot.close()


def text_of_test(script: Script, name: str, *, is_noticed: bool) -> str:
    """The source of a test of a script."""
    asserted = ["assert_ends_off", *(["assert_noticed"] if is_noticed else [])]
    settings = f", set={script.settings!r}" if script.settings else ""
    return _TEST.format(
        board=Path(script.board).name,
        imported=", ".join(asserted),
        faults="\n".join(f"    {_source(each)}," for each in script.faults),
        name=name if name.startswith("test_") else f"test_{name}",
        opened=f'{_quoted(script.board)}, doubles=True, clock="virtual"{settings}',
        for_s=script.for_s,
        asserted="\n".join(f"        {each}(robot)" for each in reversed(asserted)),
    )


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


def _source(strike: Strike) -> str:
    words = [_quoted(strike.kind)]
    if strike.device:
        words.append(_quoted(strike.device))
    words.append(f"at_s={strike.at_s!r}")
    if strike.for_s is not None:
        words.append(f"for_s={strike.for_s!r}")
    if strike.amount is not None:
        words.append(f"amount={strike.amount!r}")
    return f"Strike({', '.join(words)})"


def _quoted(text: str) -> str:
    return '"' + repr(text)[1:-1].replace('"', '\\"') + '"'
