"""What a part of the node is: something that comes and goes with the node's lifecycle."""


class Part:
    """Parameters, topics: made when the node is configured, gone when it is cleaned up.

    Each of these may raise FirmwareRuntimeError: then the transition fails, with its sentence.
    """

    def configure(self) -> None:
        """The run is there: make publishers, subscribers, parameters."""

    def activate(self) -> None:
        """The robot is armed from now on: let commands through."""

    def deactivate(self) -> None:
        """The robot is about to be disarmed, or is: let no command through."""

    def clean_up(self) -> None:
        """Remove what `configure` made, as far as it was; also called if it had failed."""

    def follow(self, revision: int) -> None:
        """Called again and again while configured; `revision` counts changes of the settings."""
