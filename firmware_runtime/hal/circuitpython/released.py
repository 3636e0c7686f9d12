"""What CircuitPython's objects of hardware have in common: `with` lets them go at its end."""

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Self


class Released(ABC):
    """Let go by `deinit`, however the block ends."""

    @abstractmethod
    def deinit(self) -> None:
        """Let it go."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        self.deinit()
