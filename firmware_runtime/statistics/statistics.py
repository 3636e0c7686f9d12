"""The statistics of one run at one moment: from the cells of its file to its figures.

Totals over models are not in the cells: they are the sums of the models' counters and the merged
histograms of their lateness, made here.
"""

from importlib import import_module
from time import monotonic_ns
from typing import Any

from msgspec import Struct

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics import fault_table
from firmware_runtime.statistics.figures import (
    Activations,
    BusFigures,
    FaultFigures,
    Figures,
    LinkFigures,
    ModelFigures,
    SerialFigures,
)
from firmware_runtime.statistics.file_header import (
    Header,
    RunFigures,
    RunState,
    conditions_of,
    waiting,
)
from firmware_runtime.statistics.histogram import Cells, Histogram, empty_cells
from firmware_runtime.statistics.history import Span, read_timeline, read_worst
from firmware_runtime.statistics.layout import (
    ARMED,
    CPU,
    ELAPSED,
    GUARD,
    HEARTBEAT,
    INPUTS_DROPPED,
    STATE,
    STEP_HISTOGRAM,
    STEPS,
    YIELDED,
    Layout,
)
from firmware_runtime.statistics.rows import (
    REFUSALS,
    BusRow,
    DeadlineRow,
    LinkRow,
    ModelRow,
    SerialRow,
    as_counted,
    read_row,
    read_rows,
)

NO_INSTANT = -1
"""Of the last overrun, where its instant means nothing: in the sum of several runs."""
TOTALS = Activations.__struct_fields__


class Statistics(Struct, frozen=True):
    """Header and cells of one run, copied while no section was being written.

    `writer_alive` says whether the process that wrote them still exists; `complete` is false if it
    died half way through a section, so that the last step's numbers may be in part.
    """

    header: Header
    cells: Cells
    writer_alive: bool = True
    complete: bool = True

    @property
    def layout(self) -> Layout:
        """Return where each number stands."""
        return self.header.layout

    @property
    def state(self) -> RunState:
        """Return how far the run has come, and how it ended."""
        return RunState(self.cells[STATE])

    @property
    def is_virtual(self) -> bool:
        """True if it ran in virtual time: nothing can be late then, nothing takes any time."""
        return bool(self.header.conditions.get("clock") == "VirtualClock")

    @property
    def reason(self) -> str | None:
        """Return how the run ended, in a sentence; None before that."""
        text = bytes(self.cells[self.layout.reason]).rstrip(b"\0")
        return text.decode("utf-8", errors="ignore") or None

    @property
    def heartbeat_age_ns(self) -> int | None:
        """Return how far logical time is behind CLOCK_MONOTONIC.

        None before the first step has ended.
        """
        heartbeat = self.cells[HEARTBEAT]
        return monotonic_ns() - heartbeat if heartbeat > 0 else None

    @property
    def timeline(self) -> list[Span]:
        """Return how the run went over time, oldest first.

        The last second only once the run has ended.
        """
        return read_timeline(self.cells[self.layout.timeline])

    def lateness(self) -> Histogram:
        """A histogram of its own: the lateness of all models' activations, in ns."""
        merged = Histogram(empty_cells())
        for index in range(len(self.layout.models)):
            merged.merge(self.lateness_of(index))
        return merged

    def lateness_of(self, index: int) -> Histogram:
        """The lateness of one model's activations, in ns."""
        return self._measured(self.layout.lateness(index))

    def own_time_of(self, index: int) -> Histogram:
        """The own time of one model, in ns."""
        return self._measured(self.layout.step(index))

    def step_times(self) -> Histogram:
        """The time of whole steps, in ns."""
        return self._measured(STEP_HISTOGRAM)

    def show(self) -> None:
        """Show the report in a notebook. Raises ConfigError where none runs this."""
        # what draws builds on this room, and is loaded by nothing but this call
        import_module("firmware_runtime.view.notebook").show_statistics(self)

    def as_json(self) -> dict[str, Any]:
        """Everything, in the spelling that other programs rely on; times in us where named so."""
        return self.figures().as_json()

    def figures(self) -> Figures:
        """Everything that is reported of the run."""
        models = {path: self._model(index) for index, path in enumerate(self.layout.models)}
        deadlines = read_rows(DeadlineRow, self.cells, self.layout.deadlines, self.layout.deadline)
        return Figures(
            **{total: sum(getattr(each, total) for each in models.values()) for total in TOTALS},
            deadline_misses={name: each.misses for name, each in deadlines.items()},
            deadlines=deadlines,
            lateness_us=self.lateness().summary_us(),
            step_us=self.step_times().summary_us(),
            models=models,
            bus={name: self._bus(index) for index, name in enumerate(self.layout.buses)},
            serial=self._all_serial(),
            faults=self.faults(),
            worst=read_worst(self.cells, self.layout),
            conditions=conditions_of(self.header.conditions, self._run(), self.cells[YIELDED]),
            link=self._link() if self.layout.has_link else None,
            late_by_cause=self._late_by_cause(),
        )

    def _late_by_cause(self) -> dict[str, int] | None:
        """Causes that made a step late; none at all in virtual time, in which nothing is."""
        counted = zip(self.layout.causes, self.cells[self.layout.late_by_cause], strict=True)
        found = {cause: steps for cause, steps in counted if steps > 0}
        return found if self.layout.causes and not self.is_virtual else None

    def faults(self) -> dict[str, dict[str, FaultFigures]]:
        """Return what models reported, by path and kind; a model without faults is left out."""
        block = self.cells[self.layout.faults]
        counted = (
            (path, fault_table.read(block, index))
            for index, path in enumerate(self.layout.fault_models)
        )
        return {
            path: {each.kind: _fault_figures(each) for each in kinds}
            for path, kinds in counted
            if kinds
        }

    def _model(self, index: int) -> ModelFigures:
        row = read_row(ModelRow, self.cells, self.layout.model(index))
        is_known = row.overruns > 0 and row.last_late_ns != NO_INSTANT
        stated = self.header.models[self.layout.models[index]]
        period_ns = stated.period_ns
        own_time = self.own_time_of(index)
        return ModelFigures(
            **as_counted(row, ModelFigures),
            last_late_t_ns=row.last_late_ns if is_known else None,
            kind="event" if period_ns is None else "periodic",
            period_us=None if period_ns is None else period_ns / 1000,
            tolerance_us=stated.tolerance_ns / 1000,
            policy=stated.policy,
            waiting=self._waiting(index),
            returned_after_us=row.returned_ns / 1000 if row.irregular > 0 else None,
            lateness_us=self.lateness_of(index).summary_us(),
            step_us=own_time.summary_us(),
            load=self._share(own_time.sum) if own_time.sum > 0 else None,
        )

    def _waiting(self, index: int) -> int:
        if not self.writer_alive:
            return 0
        return waiting(self.cells, self.header, index)

    def _measured(self, histogram: slice) -> Histogram:
        """Return what was measured; in virtual time, in which a step takes none, nothing was."""
        return Histogram(empty_cells() if self.is_virtual else self.cells[histogram])

    def _bus(self, index: int) -> BusFigures:
        row = read_row(BusRow, self.cells, self.layout.bus(index))
        return BusFigures(**as_counted(row, BusFigures), utilisation=self._share(row.busy_ns))

    def _all_serial(self) -> dict[str, SerialFigures] | None:
        found = {name: self._serial(index) for index, name in enumerate(self.layout.ports)}
        return found or None

    def _serial(self, index: int) -> SerialFigures:
        row = read_row(SerialRow, self.cells, self.layout.port(index))
        return SerialFigures(
            **as_counted(row, SerialFigures),
            writing=self._share(row.writing_ns),
            reading=self._share(row.reading_ns),
        )

    def _link(self) -> LinkFigures:
        row, layout = read_row(LinkRow, self.cells, self.layout.link), self.layout
        counted = as_counted(row, LinkFigures)
        is_good = bool(counted.pop("is_good")) and self.writer_alive
        return LinkFigures(
            **counted,
            is_good=is_good,
            refused={reason: getattr(row, reason) for reason in REFUSALS},
            age_us=Histogram(self.cells[layout.link_age]).summary_us(),
            round_trip_us=Histogram(self.cells[layout.round_trip]).summary_us(),
        )

    def _share(self, spent_ns: int) -> float | None:
        """A part of the time of the run; None at its very start."""
        return spent_ns / self.cells[ELAPSED] if self.cells[ELAPSED] > 0 else None

    def _run(self) -> RunFigures:
        state = self.state
        died = state is RunState.RUNNING and not self.writer_alive
        return RunFigures(
            state="died" if died else state.name.lower(),
            reason=self.reason,
            complete=self.complete,
            elapsed_s=self.cells[ELAPSED] / 1e9,
            steps=self.cells[STEPS],
            inputs_dropped=self.cells[INPUTS_DROPPED],
            overloaded_s=self.cells[YIELDED] / 1e9 if self.cells[YIELDED] > 0 else None,
            armed=bool(self.cells[ARMED]) and not died,
            guarded=self.is_guarded,
            cpu_s=self.cells[CPU] / 1e9 if self.cells[CPU] > 0 else None,
            began_ns=None if self.header.began is None else self.header.began[1],
        )

    @property
    def is_guarded(self) -> bool:
        """True if a guard's last sign is less than a second older than the loop's."""
        guard = self.cells[GUARD]
        return guard > 0 and self.cells[HEARTBEAT] - guard < SECOND


def _fault_figures(counted: fault_table.FaultCount) -> FaultFigures:
    """Return the figures of one kind of fault; None where an instant is not known."""
    first_s, last_s = (
        None if at == fault_table.NO_INSTANT else at / SECOND
        for at in (counted.first_at, counted.last_at)
    )
    return FaultFigures(counted.count, first_s, last_s, counted.sentence)
