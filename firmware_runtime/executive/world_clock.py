"""The clock for a world that lives in this process: register doubles, and the plant behind them."""


class WorldClock:
    """What time it is for the world while a step is under way; call it.

    A step that starts on time, within `tolerance`, happens at its logical instant: the world then
    moves by exact periods, and a run in real time gives the values of a run in virtual time. A
    late one happens when it really started. Time stands still within a step and never goes back.
    """

    def __init__(self, tolerance: int) -> None:
        self.tolerance = tolerance
        self._now = 0

    def begin(self, at: int, started: int) -> None:
        """A step for instant `at` starts at `started`."""
        instant = at if started - at <= self.tolerance else started
        if instant > self._now:
            self._now = instant

    def __call__(self) -> int:
        """Return the world's present instant, in ns since the start of the run."""
        return self._now
