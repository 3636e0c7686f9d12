"""A series over time in bounded memory: the longer it grows, the more samples make one point."""

MOST = 8192


class Series:
    """Points are means of as many samples each, at the instant of the first; fewer than `MOST`."""

    def __init__(self) -> None:
        self.points: list[tuple[int, float]] = []
        self._samples_in_point = 1
        self._began_at = 0
        self._sum = 0.0
        self._count = 0

    def add(self, at: int, value: float) -> None:
        """Add one sample; the last few of a long series wait until they make a point."""
        if self._count == 0:
            self._began_at = at
        self._sum += value
        self._count += 1
        if self._count == self._samples_in_point:
            self.points.append((self._began_at, self._sum / self._count))
            self._sum, self._count = 0.0, 0
            if len(self.points) == MOST:
                self._halve()

    def _halve(self) -> None:
        pairs = zip(self.points[::2], self.points[1::2], strict=True)
        self.points = [(at, (first + second) / 2) for (at, first), (_, second) in pairs]
        self._samples_in_point *= 2
