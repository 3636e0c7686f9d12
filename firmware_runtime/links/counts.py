"""What an end of a link counts."""

from dataclasses import dataclass, field

from firmware_runtime.links.refusal import Reason


@dataclass(slots=True)
class Counts:
    """Values and frames since the start of the run; what a carrier counts is added to it."""

    sent: int = 0
    """Values that were sent, each once."""
    repeated: int = 0
    """Values that were sent again, because they had not arrived."""
    received: int = 0
    """Values that entered the model."""
    dropped: int = 0
    """Values that a newer one of their port replaced, here, before they were sent or taken."""
    unsent: int = 0
    """Frames for which there was no room, or no other end."""
    silences: int = 0
    """How often the other end fell silent."""
    refused: dict[Reason, int] = field(default_factory=lambda: dict.fromkeys(Reason, 0))

    def refuse(self, reason: Reason) -> None:
        """Count one refusal."""
        self.refused[reason] += 1
