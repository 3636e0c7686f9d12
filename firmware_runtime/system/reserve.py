"""Memory that a process keeps for the moment when it can get no more."""

from contextlib import suppress
from typing import Final

SIZE: Final = 4 << 20


class Reserve:
    """Holds some memory, touched, so that it can be given back to the allocator and used."""

    def __init__(self) -> None:
        self._held = b""
        self.hold()

    @property
    def is_held(self) -> bool:
        """True if there is something to release."""
        return bool(self._held)

    def hold(self) -> None:
        """Take it, if there is as much."""
        with suppress(MemoryError):
            self._held = b"\1" * SIZE

    def release(self) -> None:
        """Give it back: what is allocated next may have it."""
        self._held = b""
