"""Layout of a statistics file: one row of signed 64-bit cells.

In order: the run's own cells, the histogram of step times, one block for each model (its
counters, then its histograms of lateness and of own time), one block for each bus, each deadline
and each serial port, one block for each place in the list of worst activations, the text that says
how the run ended, the timeline, one block for each model that can report faults (`fault_table`),
one for the link to the other part of a model that runs in two processes, and one cell for each
cause that can make a step late (`blame`).
Blocks of a kind have the same length; they stand in the order in which the header names models,
buses, deadlines and serial ports.

The header of the file carries `describe()`, so a program that knows nothing of this module finds
every number by name.
"""

from typing import Any

from msgspec import Struct, structs

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics import fault_table
from firmware_runtime.statistics.histogram import BUCKETS, CELLS, SUB_BUCKETS, SUM_CELL
from firmware_runtime.statistics.rows import (
    BusRow,
    DeadlineRow,
    LinkRow,
    ModelRow,
    SerialRow,
    WorstRow,
)

RUN = (
    "sequence",
    "state",
    "heartbeat_ns",
    "elapsed_ns",
    "steps",
    "inputs_dropped",
    "cpu_ns",
    "armed",
    "acknowledged",
    "yielded_ns",
    "generation",
    "guard_ns",
    "written_ns",
)
"""All written by the run, but `generation` and `guard_ns`: they are the guard's, see there."""
MODEL = ModelRow.__struct_fields__
BUS = BusRow.__struct_fields__
DEADLINE = DeadlineRow.__struct_fields__
SERIAL = SerialRow.__struct_fields__
WORST = WorstRow.__struct_fields__
LINK = LinkRow.__struct_fields__
SLOT = (
    "begin_ns",
    "used",
    "activations",
    "late",
    "skipped",
    "lateness_ns",
    "steps",
    "bus_ns",
    "cpu_ns",
    "lateness_max_ns",
    "step_max_ns",
)
WIDTHS = (SECOND, 15 * SECOND, 240 * SECOND, 3600 * SECOND)
"""Of a span of the timeline, by level, ns: each a multiple of the one before."""
SLOTS = 120
"""Spans of each level: two minutes, half an hour, eight hours, five days."""
TIMELINE = len(WIDTHS) * SLOTS * len(SLOT)
DEVICES = 8
"""How many devices of one bus have a place of their own in the list of worst activations."""

(
    SEQUENCE,
    STATE,
    HEARTBEAT,
    ELAPSED,
    STEPS,
    INPUTS_DROPPED,
    CPU,
    ARMED,
    ACKNOWLEDGED,
    YIELDED,
    EPOCH,
    GUARD,
    WRITTEN,
) = range(len(RUN))
STEP_TIMES = len(RUN)
REASON = 32
"""Cells of the text that says how the run ended: UTF-8, 8 bytes a cell, padded with zeros."""
_MODELS = STEP_TIMES + CELLS
_MODEL_CELLS = len(MODEL) + 2 * CELLS
_DEVICE_CELLS = 2 * DEVICES


class Layout(Struct, frozen=True):
    """The names a file has blocks for; everything else follows from them."""

    models: tuple[str, ...] = ()
    """Every model, by path."""
    timed: tuple[str, ...] = ()
    """Every model, by path: whose own time is kept in the list of worst activations."""
    buses: tuple[str, ...] = ()
    deadlines: tuple[str, ...] = ()
    worst: int = 16
    fault_models: tuple[str, ...] = ()
    """Models with a port for faults, by path."""
    has_link: bool = False
    blame: tuple[str, ...] = ()
    """What a place of the list of worst activations says of its cause, a cell each."""
    causes: tuple[str, ...] = ()
    """What can make an activation late, by name; how often each did is counted."""
    ports: tuple[str, ...] = ()
    """Every serial port."""

    def model(self, index: int) -> int:
        """First cell of a model's block."""
        return _MODELS + index * _MODEL_CELLS

    def lateness(self, index: int) -> slice:
        """A model's histogram of lateness."""
        first = self.model(index) + len(MODEL)
        return slice(first, first + CELLS)

    def step(self, index: int) -> slice:
        """A model's histogram of its own time."""
        first = self.model(index) + len(MODEL) + CELLS
        return slice(first, first + CELLS)

    def bus(self, index: int) -> int:
        """First cell of a bus's block."""
        return self.model(len(self.models)) + index * len(BUS)

    def deadline(self, index: int) -> int:
        """First cell of a deadline's block."""
        return self.bus(len(self.buses)) + index * len(DEADLINE)

    def port(self, index: int) -> int:
        """First cell of a serial port's block."""
        return self.deadline(len(self.deadlines)) + index * len(SERIAL)

    def place(self, index: int) -> int:
        """First cell of a place in the list of worst activations."""
        return self.port(len(self.ports)) + index * self.place_cells

    @property
    def place_cells(self) -> int:
        """Fields, own times of models, for each bus its devices' addresses and times, the cause."""
        return self._blame_at + len(self.blame)

    @property
    def _blame_at(self) -> int:
        return len(WORST) + len(self.timed) + len(self.buses) * _DEVICE_CELLS

    def blame_of(self, index: int) -> slice:
        """The cells of a place that say why it was late."""
        first = self.place(index) + self._blame_at
        return slice(first, first + len(self.blame))

    @property
    def cells(self) -> int:
        """Number of cells there are in all."""
        cells: int = self.late_by_cause.stop
        return cells

    @property
    def reason(self) -> slice:
        """The text that says how the run ended."""
        first = self.place(self.worst)
        return slice(first, first + REASON)

    @property
    def timeline(self) -> slice:
        """The rings of the timeline, the finest first."""
        first = self.place(self.worst) + REASON
        return slice(first, first + TIMELINE)

    @property
    def faults(self) -> slice:
        """The faults of each of `fault_models`, see `fault_table`."""
        return slice(self.timeline.stop, self.link)

    @property
    def link(self) -> int:
        """First cell of the link's block, where there is one, behind the faults."""
        timeline_ends: int = self.timeline.stop
        return timeline_ends + len(self.fault_models) * fault_table.MODEL_CELLS

    @property
    def link_age(self) -> slice:
        """The histogram of the ages of values when they arrived."""
        first = self.link + len(LINK)
        return slice(first, first + CELLS)

    @property
    def round_trip(self) -> slice:
        """The histogram of the link's round trips."""
        return slice(self.link_age.stop, self.link_age.stop + CELLS)

    @property
    def late_by_cause(self) -> slice:
        """Return how often each of `causes` made a step late, a cell each, behind all others."""
        first = self.link + (len(LINK) + 2 * CELLS if self.has_link else 0)
        return slice(first, first + len(self.causes))

    def describe(self) -> dict[str, Any]:
        """The layout as the file's header carries it, with every offset and stride in cells."""
        return {
            **structs.asdict(self),
            "cells": self.cells,
            "histogram": {"buckets": BUCKETS, "sub_buckets": SUB_BUCKETS, "then": ["max", "sum"]},
            **self._counter_blocks(),
            **self._kept_blocks(),
            **self._fault_block(),
        }

    def _counter_blocks(self) -> dict[str, object]:
        """Return what counts up: the run, its models, buses, deadlines and serial ports."""
        return {
            "run_block": {"at": 0, "fields": RUN, "then": ["step histogram"]},
            "model_block": {
                "at": _MODELS,
                "stride": _MODEL_CELLS,
                "fields": MODEL,
                "then": ["lateness histogram", "step histogram"],
            },
            "bus_block": {"at": self.bus(0), "stride": len(BUS), "fields": BUS},
            "deadline_block": {
                "at": self.deadline(0),
                "stride": len(DEADLINE),
                "fields": DEADLINE,
            },
            "port_block": {"at": self.port(0), "stride": len(SERIAL), "fields": SERIAL},
        }

    def _kept_blocks(self) -> dict[str, object]:
        """Return the blocks of single events: the worst, the ending, the timeline."""
        return {
            "worst_block": {
                "at": self.place(0),
                "stride": self.place_cells,
                "fields": WORST,
                "then": [
                    "own time of each of `timed`",
                    "for each bus 8 addresses, then 8 times",
                    "a cell for each of `blame`",
                ],
            },
            "reason_block": {"at": self.reason.start, "cells": REASON, "text": "UTF-8"},
            "timeline_block": {
                "at": self.timeline.start,
                "stride": len(SLOT),
                "fields": SLOT,
                "slots": SLOTS,
                "widths_ns": WIDTHS,
            },
        }

    def _fault_block(self) -> dict[str, object]:
        return {
            "fault_block": {
                "at": self.faults.start,
                "stride": fault_table.ROW_CELLS,
                "rows": fault_table.ROWS,
                "fields": fault_table.FAULT,
                "then": [
                    f"kind in {fault_table.KIND_CELLS} cells of UTF-8",
                    f"sentence in {fault_table.SENTENCE_CELLS} cells of UTF-8",
                ],
            },
            **self._describe_link(),
            "late_by_cause_block": {"at": self.late_by_cause.start, "fields": self.causes},
        }

    def _describe_link(self) -> dict[str, object]:
        if not self.has_link:
            return {}
        then = ["age histogram", "round trip histogram"]
        return {"link_block": {"at": self.link, "fields": LINK, "then": then}}


STEP_HISTOGRAM = slice(STEP_TIMES, STEP_TIMES + CELLS)
STEP_TIME = STEP_TIMES + SUM_CELL
"""The cell with the time of all steps together, ns."""
