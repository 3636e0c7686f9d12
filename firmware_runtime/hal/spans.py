"""Spans of time in which a fault lasts that is of no chip; some have no end yet."""

from firmware_runtime.devs.time import NEVER


class Spans:
    """From an instant, included, to another one, in ns; any number of them, which may overlap."""

    def __init__(self) -> None:
        self._spans: list[tuple[int, int]] = []

    def add(self, at: int, until: int) -> None:
        """Add one; NEVER is without an end."""
        self._spans.append((at, until))

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self._spans)

    def end(self, at: int) -> None:
        """Let what has no end be over at an instant."""
        self._spans = [(begin, at if until == NEVER else until) for begin, until in self._spans]

    def clear(self) -> None:
        """Forget them all."""
        self._spans.clear()

    def have(self, now: int) -> bool:
        """Return whether an instant is in one of them."""
        return any(begin <= now < until for begin, until in self._spans)

    def next_change(self, now: int) -> int:
        """Return the first instant after `now` at which one begins or ends; NEVER for none."""
        return min((at for span in self._spans for at in span if at > now), default=NEVER)
