"""What fails at each use in a run, since when that has shown, and until when."""

from collections.abc import Iterator
from typing import NamedTuple

from firmware_runtime.lab.campaign.cause import Cause, Failing
from firmware_runtime.lab.campaign.healthy import Healthy
from firmware_runtime.lab.campaign.watched import Watched


class Failure(NamedTuple):
    """A device, or a line, that fails at each use; ns of the run."""

    device: str
    since: int
    end: int


class Failures:
    """Those of one run that have shown by now, whenever it is gone through."""

    def __init__(self, watched: Watched, healthy: Healthy, cause: Cause) -> None:
        self._watched = watched
        self._healthy = healthy
        self._cause = cause
        self._shown: dict[Failing, int] = {}

    def __iter__(self) -> Iterator[Failure]:
        for each in self._cause.failing:
            if each not in self._shown and (at := self._shown_at(each)) is not None:
                self._shown[each] = at
            if each in self._shown:
                yield Failure(each.device, self._shown[each], each.end)

    def _shown_at(self, failing: Failing) -> int | None:
        """Return when a use first failed of what has a name; of other lines, when any has."""
        for place in self._healthy.places:
            if place.name == failing.device:
                return self._watched.shown_at(place, failing.kind, failing.at)
        struck_at = self._watched.struck_at
        return None if struck_at is None else max(failing.at, struck_at)
