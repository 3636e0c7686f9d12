"""Fewer points of a curve that has more than can be seen: no peak is lost."""

from collections.abc import Sequence


def thinned(
    times: Sequence[float], values: Sequence[float], most: int
) -> tuple[Sequence[float], Sequence[float]]:
    """The least and the greatest of every so many points, in their order; all, where few enough."""
    count = len(times)
    if count <= most:
        return times, values
    every = -(-2 * count // most)
    kept: list[int] = []
    for begin in range(0, count, every):
        places = range(begin, min(begin + every, count))
        least, greatest = (choose(places, key=values.__getitem__) for choose in (min, max))
        kept += sorted({least, greatest})
    return [times[each] for each in kept], [values[each] for each in kept]
