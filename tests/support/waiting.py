"""Waiting for an event, with a bound that only a test that fails ever reaches."""

from collections.abc import Callable
from select import select
from time import monotonic

PATIENCE_S = 120
"""How long a test waits for what must happen: many times what the busiest machine takes, s."""
HANGS_S = 900
"""After how long a program that should end by itself hangs, s: some run campaigns."""
LOOK_S = 0.01


def _nothing() -> str:
    return ""


def wait_until(true: Callable[[], bool], what: str, why: Callable[[], str] = _nothing) -> None:
    """Look again and again; the time between is spent in select, as the tool of last resort.

    `why` says what stood in the way when there was no more patience.
    """
    give_up_at = monotonic() + PATIENCE_S
    while not true():
        assert monotonic() < give_up_at, f"not within {PATIENCE_S} s: {what}\n{why()}"
        select((), (), (), LOOK_S)
