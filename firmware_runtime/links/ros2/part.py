"""What a part of the node is: something that comes and goes with the node's lifecycle."""

from typing import Protocol


class Part(Protocol):
    """Parameters, topics: made when the node is configured, gone when it is cleaned up.

    Each of these may raise FirmwareRuntimeError: then the transition fails, with its sentence.
    """

    def configure(self) -> None:
        """The run is there: make publishers, subscribers, parameters."""

    def activate(self) -> None:
        """The robot is armed from now on: let commands through."""

    def deactivate(self) -> None:
        """The robot is about to be disarmed: let no command through."""

    def clean_up(self) -> None:
        """Remove what `configure` made; called at the node's end too."""
