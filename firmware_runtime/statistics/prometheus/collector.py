"""Reads statistics files at each scrape, and keeps nothing in between."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.prometheus.families import Families
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics


class StatisticsCollector(Collector):
    """Collects from the files that `find` names at that moment, by board."""

    def __init__(self, find: Callable[[], Mapping[str, Path]]) -> None:
        self._find = find

    def collect(self) -> Iterator[Metric]:
        """Read every file; one that cannot be read makes `firmware_runtime_up` 0 for its board."""
        families = Families()
        for board, path in self._find().items():
            try:
                families.add(board, read_statistics(path))
            except StatisticsFileError:
                families.add_unreadable(board)
        yield from families.all()


class _OneReading(Collector):
    def __init__(self, board: str, statistics: Statistics) -> None:
        self._board = board
        self._statistics = statistics

    def collect(self) -> Iterator[Metric]:
        families = Families()
        families.add(self._board, self._statistics)
        yield from families.all()


def exposition(board: str, statistics: Statistics) -> str:
    """One reading in the text format."""
    return text_of(_OneReading(board, statistics))


def text_of(collector: Collector) -> str:
    """What a collector finds now, in the text format."""
    registry = CollectorRegistry()
    registry.register(collector)
    return generate_latest(registry).decode()
