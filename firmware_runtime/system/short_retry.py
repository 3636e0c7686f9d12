"""What another process holds, or does not serve yet: tried again for a moment."""

from collections.abc import Callable
from time import monotonic, sleep
from typing import Final, TypeVar

T = TypeVar("T")

PAUSE_S: Final = 0.02
"""Between two attempts."""


def tried_again(take: Callable[[], T], errors: tuple[type[Exception], ...], within_s: float) -> T:
    """Return what `take` does; where it raises one of `errors`, try again for `within_s` seconds.

    Raises the error of the last attempt, and at once any other.
    """
    give_up_at = monotonic() + within_s
    while True:
        try:
            return take()
        except errors:
            if monotonic() >= give_up_at:
                raise
        sleep(PAUSE_S)
