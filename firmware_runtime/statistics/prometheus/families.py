"""The metrics: their names, their labels, and how the numbers of a run become their samples.

Units are seconds, counters end in `_total`. The bounds of histograms are powers of two nanoseconds
less one: edges of the runtime's own buckets, so every count is exact, and so are the sums. A new
run starts its counters at zero, as a restart of any program does.
"""

from collections.abc import Iterable, Mapping

from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    InfoMetricFamily,
)
from prometheus_client.metrics_core import Metric

from firmware_runtime.statistics.conditions import Conditions
from firmware_runtime.statistics.figures import BusFigures, LinkFigures, ModelFigures, SerialFigures
from firmware_runtime.statistics.histogram import Histogram, bucket_of
from firmware_runtime.statistics.rows import BusRow, SerialRow, read_row
from firmware_runtime.statistics.statistics import Statistics

SECOND = 1e9
BOUNDS = [(1 << power) - 1 for power in range(10, 35)]
"""Ns: 1 us to 17 s, each twice the one before."""
_INFORMATION = ("kernel", "machine", "model", "governor", "scheduler", "scheduler_priority")
_OUTCOMES = ("run", "skipped", "coalesced")
_BUS_COUNTERS = {
    "transactions": "Transactions on a bus",
    "bytes": "Bytes on a bus, addresses included",
    "errors": "Transactions on a bus that failed, each attempt",
    "retries": "Transactions on a bus that were tried again",
}
_SERIAL_COUNTERS = {
    "writes": "Writes to a serial port",
    "bytes_written": "Bytes that a serial port took",
    "bytes_read": "Bytes that were taken from a serial port",
    "errors": "Calls of a serial port that failed",
}
_LINK_COUNTERS = {
    "sent": "Values that were sent over a link",
    "repeated": "Values that were sent again",
    "received": "Values that entered the model over a link",
    "dropped": "Values that arrived, and in whose place a newer one was taken",
    "overtaken": "Values that arrived after a newer one",
    "given_up": "Values that left here and were given up",
    "unconnected": "Values that left here while no other end was there",
    "unsent": "Datagrams that found no room, or no other end",
    "silences": "Times the other end fell silent",
}
_PREFIX = "firmware_runtime"


class Families:
    """Takes up the statistics of one board after the other."""

    def __init__(self) -> None:
        board, model, bus = ["board"], ["board", "model"], ["board", "bus"]
        self._up = _gauge("up", "Whether the run is alive and its statistics can be read", board)
        self._armed = _gauge("armed", "Whether the run may drive its outputs", board)
        self._guarded = _gauge("guarded", "Whether a guard watches over the run", board)
        self._overloaded = _gauge(
            "overloaded", "Whether the run had no time left and gave up real-time priority", board
        )
        self._age = _gauge(
            "heartbeat_age_seconds", "How far logical time is behind the clock", board
        )
        self._run = InfoMetricFamily(f"{_PREFIX}_run", "Conditions of the run", labels=board)
        self._elapsed = _counter("elapsed_seconds", "Time since the start of the run", board)
        self._cpu = _counter("cpu_seconds", "Processor time the run has used", board)
        self._steps = _counter("steps", "Steps of the loop", board)
        self._late_steps = _counter(
            "late_steps", "Steps that were late, by what made them so", [*board, "cause"]
        )
        self._dropped = _counter("inputs_dropped", "Inputs that found no room", board)
        self._activations = _counter(
            "activations", "What became of scheduled activations", [*model, "outcome"]
        )
        self._overruns = _counter("overruns", "Activations later than the tolerance", model)
        self._episodes = _counter("overrun_episodes", "Rows of overruns and skips", model)
        self._irregular = _counter(
            "irregular_activations", "Activations at another time than the period says", model
        )
        self._reactions = _counter("reactions", "Answers to inputs, without a deadline", model)
        self._waiting = _gauge("waiting", "Activations that are due and wait for their turn", model)
        self._misses = _counter(
            "deadline_misses", "Samples not in effect in time", ["board", "deadline"]
        )
        self._faults = _counter("faults", "Faults that a model reported", [*model, "kind"])
        self._bus = {
            name: _counter(f"bus_{name}", about, bus) for name, about in _BUS_COUNTERS.items()
        }
        self._busy = _counter("bus_busy_seconds", "Time on the wire, computed from bits", bus)
        port = ["board", "port"]
        self._serial = {
            name: _counter(f"serial_{name}", about, port)
            for name, about in _SERIAL_COUNTERS.items()
        }
        self._serial_time = _counter(
            "serial_seconds", "Time of a serial port's bytes, computed", [*port, "direction"]
        )
        self._late = _histogram("lateness_seconds", "Start of activations after deadline", model)
        self._own = _histogram("own_time_seconds", "Own time of a model in its steps", model)
        self._link_good = _gauge("link_good", "Whether the other part of the model answers", board)
        self._link = {
            name: _counter(f"link_{name}", about, board) for name, about in _LINK_COUNTERS.items()
        }
        self._refused = _counter(
            "link_refused", "Datagrams of a link that were refused", [*board, "reason"]
        )
        self._age_of_values = _histogram(
            "link_age_seconds", "Age of a link's values when they arrived", board
        )
        self._round_trip = _histogram("link_round_trip_seconds", "Round trips of a link", board)
        self._step = _histogram("step_seconds", "Time of whole steps", board)

    def all(self) -> Iterable[Metric]:
        """Every family that has a sample."""
        families = (each for each in vars(self).values() if isinstance(each, Metric))
        named = (*self._bus.values(), *self._serial.values(), *self._link.values())
        return [each for each in (*families, *named) if each.samples]

    def add_unreadable(self, board: str) -> None:
        """Take up a board whose statistics cannot be read."""
        self._up.add_metric([board], 0)

    def add(self, board: str, statistics: Statistics) -> None:
        """Take up one board."""
        figures = statistics.figures()
        run = figures.conditions.run
        is_running = run.state == "running"
        self._up.add_metric([board], is_running)
        self._armed.add_metric([board], run.armed)
        self._guarded.add_metric([board], run.guarded)
        self._overloaded.add_metric([board], run.overloaded_s is not None)
        age_ns = statistics.heartbeat_age_ns
        if is_running and age_ns is not None:
            self._age.add_metric([board], age_ns / SECOND)
        self._run.add_metric([board], _information(figures.conditions))
        self._elapsed.add_metric([board], run.elapsed_s)
        if run.cpu_s is not None:
            self._cpu.add_metric([board], run.cpu_s)
        self._steps.add_metric([board], run.steps)
        self._dropped.add_metric([board], run.inputs_dropped)
        for cause, steps in (figures.late_by_cause or {}).items():
            self._late_steps.add_metric([board, cause], steps)
        _add(self._step, [board], statistics.step_times())
        for name, missed in figures.deadline_misses.items():
            self._misses.add_metric([board, name], missed)
        for path, kinds in figures.faults.items():
            for kind, counted in kinds.items():
                self._faults.add_metric([board, path, kind], counted.count)
        self._add_models(board, statistics, figures.models)
        self._add_buses(board, statistics, figures.bus)
        self._add_ports(board, statistics, figures.serial or {})
        if figures.link is not None:
            self._add_link(board, statistics, figures.link)

    def _add_link(self, board: str, statistics: Statistics, link: LinkFigures) -> None:
        self._link_good.add_metric([board], link.is_good)
        for counter, family in self._link.items():
            family.add_metric([board], getattr(link, counter))
        for reason, count in link.refused.items():
            self._refused.add_metric([board, reason], count)
        cells, layout = statistics.cells, statistics.layout
        _add(self._age_of_values, [board], Histogram(cells[layout.link_age]))
        _add(self._round_trip, [board], Histogram(cells[layout.round_trip]))

    def _add_models(
        self, board: str, statistics: Statistics, models: Mapping[str, ModelFigures]
    ) -> None:
        for index, (path, model) in enumerate(models.items()):
            for outcome in _OUTCOMES:
                self._activations.add_metric([board, path, outcome], getattr(model, outcome))
            self._overruns.add_metric([board, path], model.overruns)
            self._episodes.add_metric([board, path], model.episodes)
            self._irregular.add_metric([board, path], model.irregular)
            self._reactions.add_metric([board, path], model.reactions)
            self._waiting.add_metric([board, path], model.waiting)
            _add(self._late, [board, path], statistics.lateness_of(index))
            _add(self._own, [board, path], statistics.own_time_of(index))

    def _add_buses(
        self, board: str, statistics: Statistics, buses: Mapping[str, BusFigures]
    ) -> None:
        for index, (name, bus) in enumerate(buses.items()):
            for counter, family in self._bus.items():
                family.add_metric([board, name], getattr(bus, counter))
            row = read_row(BusRow, statistics.cells, statistics.layout.bus(index))
            self._busy.add_metric([board, name], row.busy_ns / SECOND)

    def _add_ports(
        self, board: str, statistics: Statistics, ports: Mapping[str, SerialFigures]
    ) -> None:
        for index, (name, port) in enumerate(ports.items()):
            for counter, family in self._serial.items():
                family.add_metric([board, name], getattr(port, counter))
            row = read_row(SerialRow, statistics.cells, statistics.layout.port(index))
            times = {"writing": row.writing_ns, "reading": row.reading_ns}
            for direction, span in times.items():
                self._serial_time.add_metric([board, name, direction], span / SECOND)


def _counter(name: str, about: str, labels: list[str]) -> CounterMetricFamily:
    return CounterMetricFamily(f"{_PREFIX}_{name}", f"{about}.", labels=labels)


def _gauge(name: str, about: str, labels: list[str]) -> GaugeMetricFamily:
    return GaugeMetricFamily(f"{_PREFIX}_{name}", f"{about}.", labels=labels)


def _histogram(name: str, about: str, labels: list[str]) -> HistogramMetricFamily:
    return HistogramMetricFamily(f"{_PREFIX}_{name}", f"{about}.", labels=labels)


def _add(family: HistogramMetricFamily, labels: list[str], histogram: Histogram) -> None:
    buckets = histogram.buckets.tolist()
    counts = [(repr(edge / SECOND), sum(buckets[: bucket_of(edge) + 1])) for edge in BOUNDS]
    family.add_metric(labels, [*counts, ("+Inf", sum(buckets))], histogram.sum / SECOND)


def _information(conditions: Conditions) -> dict[str, str]:
    known = {name: conditions.text(name) for name in _INFORMATION}
    return {name: text for name, text in known.items() if text is not None}
