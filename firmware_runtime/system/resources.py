"""Resources that are closed at the end of a block, or awaited while another process has them."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from time import monotonic, sleep
from types import TracebackType
from typing import Final, Self, TypeVar


class Closing(ABC):
    """A context manager that closes itself, however the block ends."""

    @abstractmethod
    def close(self) -> object:
        """Give back what is held."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


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
