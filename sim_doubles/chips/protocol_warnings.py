"""What a host did that the real chip would ignore, refuse or leave undefined."""

KEPT = 100


class ProtocolWarnings(list[str]):
    """The first hundred warnings of one chip, as sentences; `total` counts all of them."""

    def __init__(self, chip: str) -> None:
        super().__init__()
        self.chip = chip
        self.total = 0

    def note(self, sentence: str) -> None:
        """Keep one warning: what was done, and what the real chip makes of it."""
        self.total += 1
        if len(self) < KEPT:
            self.append(f"{self.chip}: {sentence}")
