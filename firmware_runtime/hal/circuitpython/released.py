"""Base of CircuitPython's objects of hardware: `with` releases them at its end."""

from abc import abstractmethod

from firmware_runtime.system.resources import Closing


class Released(Closing):
    """Let go by `deinit`, however the block ends."""

    @abstractmethod
    def deinit(self) -> None:
        """Let it go."""

    def close(self) -> None:
        """Do as `deinit` does."""
        self.deinit()
