"""Abilities that only some chips have, for boards on which either may be."""

from typing import Protocol, runtime_checkable


@runtime_checkable
class Identifiable(Protocol):
    """A chip that answers at once; one that only listens, or only sends, does not."""

    def identify(self) -> None:
        """Check that it is there and can be what it should be. Raises HalError."""


@runtime_checkable
class ReadBack(Protocol):
    """A chip that drives something and can be read back."""

    def still_on(self) -> str | None:
        """Return a sentence with its outputs that are on; None if none is. Raises HalError."""
