"""The metrics: their names, their labels, and how the numbers of a run become their samples.

Units are seconds, counters end in `_total`. The bounds of histograms are powers of two nanoseconds
less one: edges of the runtime's own buckets, so every count is exact, and so are the sums. A new
run starts its counters at zero, as a restart of any program does. Statistics files are read at each
scrape, and nothing is kept in between.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TypeVar

from msgspec import Struct
from msgspec.structs import asdict
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    InfoMetricFamily,
)
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.figures import LinkFigures, ModelFigures
from firmware_runtime.statistics.file_header import Conditions
from firmware_runtime.statistics.histogram import Histogram, bucket_of
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.rows import BusRow, SerialRow, read_row
from firmware_runtime.statistics.statistics import Statistics

SECOND = 1e9
BOUNDS = [(1 << power) - 1 for power in range(10, 35)]
"""Ns: 1 us to 17 s, each twice the one before."""
_INFORMATION = ("kernel", "machine", "model", "governor", "scheduler", "scheduler_priority")
_OUTCOMES = ("run", "skipped", "coalesced")
_PREFIX = "firmware_runtime"
_COUNTERS = {
    "elapsed_seconds": "Time since the start of the run",
    "cpu_seconds": "Processor time the run has used",
    "steps": "Steps of the loop",
    "late_steps cause": "Steps that were late, by what made them so",
    "inputs_dropped": "Inputs that found no room",
    "activations model outcome": "What became of scheduled activations",
    "overruns model": "Activations later than the tolerance",
    "overrun_episodes model": "Rows of overruns and skips",
    "irregular_activations model": "Activations at another time than the period says",
    "reactions model": "Answers to inputs, without a deadline",
    "deadline_misses deadline": "Samples not in effect in time",
    "faults model kind": "Faults that a model reported",
    "bus_transactions bus": "Transactions on a bus",
    "bus_bytes bus": "Bytes on a bus, addresses included",
    "bus_errors bus": "Transactions on a bus that failed, each attempt",
    "bus_retries bus": "Transactions on a bus that were tried again",
    "bus_busy_seconds bus": "Time on the wire, computed from bits",
    "serial_writes port": "Writes to a serial port",
    "serial_bytes_written port": "Bytes that a serial port took",
    "serial_bytes_read port": "Bytes that were taken from a serial port",
    "serial_errors port": "Calls of a serial port that failed",
    "serial_seconds port direction": "Time of a serial port's bytes, computed",
    "link_sent": "Values that were sent over a link",
    "link_repeated": "Values that were sent again",
    "link_received": "Values that entered the model over a link",
    "link_dropped": "Values that arrived, and in whose place a newer one was taken",
    "link_overtaken": "Values that arrived after a newer one",
    "link_given_up": "Values that left here and were given up",
    "link_unconnected": "Values that left here while no other end was there",
    "link_unsent": "Datagrams that found no room, or no other end",
    "link_silences": "Times the other end fell silent",
    "link_refused reason": "Datagrams of a link that were refused",
}
_GAUGES = {
    "up": "Whether the run is alive and its statistics can be read",
    "armed": "Whether the run may drive its outputs",
    "guarded": "Whether a guard watches over the run",
    "overloaded": "Whether the run had no time left and gave up real-time priority",
    "heartbeat_age_seconds": "How far logical time is behind the clock",
    "waiting model": "Activations that are due and wait for their turn",
    "link_good": "Whether the other part of the model answers",
}
_HISTOGRAMS = {
    "lateness_seconds model": "Start of activations after deadline",
    "own_time_seconds model": "Own time of a model in its steps",
    "step_seconds": "Time of whole steps",
    "link_age_seconds": "Age of a link's values when they arrived",
    "link_round_trip_seconds": "Round trips of a link",
}
"""Every metric with its labels beside `board`, and its help."""
Family = TypeVar("Family", CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily)


class Families:
    """Samples of one board after the other."""

    def __init__(self) -> None:
        self._values: dict[str, CounterMetricFamily | GaugeMetricFamily] = {
            **_families(CounterMetricFamily, _COUNTERS),
            **_families(GaugeMetricFamily, _GAUGES),
        }
        self._histograms = _families(HistogramMetricFamily, _HISTOGRAMS)
        self._run = InfoMetricFamily(f"{_PREFIX}_run", "Conditions of the run.", labels=["board"])

    def all(self) -> Iterable[Metric]:
        """Return every family that has a sample."""
        families = (*self._values.values(), *self._histograms.values(), self._run)
        return [each for each in families if each.samples]

    def add_unreadable(self, board: str) -> None:
        """Add a board whose statistics cannot be read."""
        self._add({"up": 0}, board)

    def add(self, board: str, statistics: Statistics) -> None:
        """Add one board."""
        figures = statistics.figures()
        run = figures.conditions.run
        is_running = run.state == "running"
        age_ns = statistics.heartbeat_age_ns
        self._add(
            {
                "up": is_running,
                "armed": run.armed,
                "guarded": run.guarded,
                "overloaded": run.overloaded_s is not None,
                "heartbeat_age_seconds": age_ns / SECOND if is_running and age_ns else None,
                "elapsed_seconds": run.elapsed_s,
                "cpu_seconds": run.cpu_s,
                "steps": run.steps,
                "inputs_dropped": run.inputs_dropped,
            },
            board,
        )
        self._run.add_metric([board], _information(figures.conditions))
        for cause, steps in (figures.late_by_cause or {}).items():
            self._add({"late_steps": steps}, board, cause)
        self._add_histogram("step_seconds", statistics.step_times(), board)
        for name, missed in figures.deadline_misses.items():
            self._add({"deadline_misses": missed}, board, name)
        for path, kinds in figures.faults.items():
            for kind, counted in kinds.items():
                self._add({"faults": counted.count}, board, path, kind)
        self._add_models(board, statistics, figures.models)
        cells, layout = statistics.cells, statistics.layout
        for index, (name, bus) in enumerate(figures.bus.items()):
            busy_ns = read_row(BusRow, cells, layout.bus(index)).busy_ns
            self._add(self._counters("bus", bus), board, name)
            self._add({"bus_busy_seconds": busy_ns / SECOND}, board, name)
        for index, (name, port) in enumerate((figures.serial or {}).items()):
            row = read_row(SerialRow, cells, layout.port(index))
            self._add(self._counters("serial", port), board, name)
            self._add({"serial_seconds": row.writing_ns / SECOND}, board, name, "writing")
            self._add({"serial_seconds": row.reading_ns / SECOND}, board, name, "reading")
        if figures.link is not None:
            self._add_link(board, statistics, figures.link)

    def _add_link(self, board: str, statistics: Statistics, link: LinkFigures) -> None:
        self._add({"link_good": link.is_good, **self._counters("link", link)}, board)
        for reason, count in link.refused.items():
            self._add({"link_refused": count}, board, reason)
        cells, layout = statistics.cells, statistics.layout
        self._add_histogram("link_age_seconds", Histogram(cells[layout.link_age]), board)
        self._add_histogram("link_round_trip_seconds", Histogram(cells[layout.round_trip]), board)

    def _add_models(
        self, board: str, statistics: Statistics, models: Mapping[str, ModelFigures]
    ) -> None:
        for index, (path, model) in enumerate(models.items()):
            for outcome in _OUTCOMES:
                self._add({"activations": getattr(model, outcome)}, board, path, outcome)
            self._add(
                {
                    "overruns": model.overruns,
                    "overrun_episodes": model.episodes,
                    "irregular_activations": model.irregular,
                    "reactions": model.reactions,
                    "waiting": model.waiting,
                },
                board,
                path,
            )
            self._add_histogram("lateness_seconds", statistics.lateness_of(index), board, path)
            self._add_histogram("own_time_seconds", statistics.own_time_of(index), board, path)

    def _counters(self, kind: str, figures: Struct) -> Mapping[str, float | None]:
        """Return the counters that have a metric of their name, by that name."""
        values = {f"{kind}_{name}": value for name, value in asdict(figures).items()}
        return {
            name: value
            for name, value in values.items()
            if name in self._values and isinstance(value, int)
        }

    def _add(self, values: Mapping[str, float | None], *labels: str) -> None:
        """Add a sample to each of these metrics; None is no sample."""
        for name, value in values.items():
            if value is not None:
                self._values[name].add_metric(labels, value)

    def _add_histogram(self, name: str, histogram: Histogram, *labels: str) -> None:
        buckets = histogram.buckets.tolist()
        counts = [(repr(edge / SECOND), sum(buckets[: bucket_of(edge) + 1])) for edge in BOUNDS]
        counts.append(("+Inf", sum(buckets)))
        self._histograms[name].add_metric(labels, counts, histogram.sum / SECOND)


def _families(kind: type[Family], named: Mapping[str, str]) -> dict[str, Family]:
    families = {}
    for name_and_labels, about in named.items():
        name, *labels = name_and_labels.split()
        families[name] = kind(f"{_PREFIX}_{name}", f"{about}.", labels=["board", *labels])
    return families


def _information(conditions: Conditions) -> dict[str, str]:
    known = {name: conditions.text(name) for name in _INFORMATION}
    return {name: text for name, text in known.items() if text is not None}


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
    """Return what a collector finds now, in the text format."""
    registry = CollectorRegistry()
    registry.register(collector)
    return generate_latest(registry).decode()
