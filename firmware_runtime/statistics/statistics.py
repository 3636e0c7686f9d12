"""The statistics of one run, at one moment, as the JSON that `stats` prints.

Totals over models are not in the cells: they are the sums of the models' counters and the merged
histograms of their lateness, made here.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from time import monotonic_ns
from typing import Any

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics import fault_table
from firmware_runtime.statistics.histogram import Cells, Histogram, empty_cells
from firmware_runtime.statistics.layout import (
    ARMED,
    BUS,
    CPU,
    DEADLINE,
    DEVICES,
    ELAPSED,
    GUARD,
    HEARTBEAT,
    INPUTS_DROPPED,
    MODEL,
    STATE,
    STEP_HISTOGRAM,
    STEPS,
    WORST,
    YIELDED,
    Layout,
)
from firmware_runtime.statistics.overdue import waiting
from firmware_runtime.statistics.refusals import as_they_hold
from firmware_runtime.statistics.timeline import Span, read_timeline

SCHEMA = 1
NO_INSTANT = -1
"""Of the last overrun, where its instant means nothing: in the sum of several runs."""
TOTALS = ("scheduled", "run", "skipped", "coalesced", "overruns", "episodes")


class RunState(IntEnum):
    """How far a run has come, and how it ended."""

    RUNNING = 0
    ENDED = 1
    STOPPED = 2
    FAILED = 3
    OVERRUN = 4


@dataclass(frozen=True, slots=True)
class Statistics:
    """Header and cells of one run, copied while no section was being written.

    `writer_alive` says whether the process that wrote them still exists; `complete` is false if it
    died half way through a section, so that the last step's numbers may be in part.
    """

    header: dict[str, Any]
    layout: Layout
    cells: Cells
    writer_alive: bool = True
    complete: bool = True

    @property
    def state(self) -> RunState:
        """How far the run has come, and how it ended."""
        return RunState(self.cells[STATE])

    @property
    def is_virtual(self) -> bool:
        """Whether it ran in virtual time: nothing can be late then, nothing takes any time."""
        return bool(self.header["conditions"].get("clock") == "VirtualClock")

    @property
    def reason(self) -> str | None:
        """How the run ended, in a sentence; None before that."""
        text = bytes(self.cells[self.layout.reason]).rstrip(b"\0")
        return text.decode("utf-8", errors="ignore") or None

    @property
    def heartbeat_age_ns(self) -> int | None:
        """How far logical time is behind CLOCK_MONOTONIC; None before the first step has ended."""
        heartbeat = self.cells[HEARTBEAT]
        return monotonic_ns() - heartbeat if heartbeat > 0 else None

    @property
    def timeline(self) -> list[Span]:
        """How the run went over time, oldest first; the last second only once the run has ended."""
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

    def late_activations(self) -> Iterator[tuple[str, int, int]]:
        """Model, deadline and lateness, both in ns, of the worst activations, in no order."""
        for number in range(self.layout.worst if self.layout.models else 0):
            entry = self._fields(self.layout.place(number), WORST)
            if entry["lateness_ns"] > 0:
                yield self.layout.models[entry["model"]], entry["t_ns"], entry["lateness_ns"]

    def faults(self) -> dict[str, Any]:
        """What models reported, by path and kind; a model without faults is left out."""
        block = self.cells[self.layout.faults]
        counted = (
            (path, fault_table.read(block, index))
            for index, path in enumerate(self.layout.fault_models)
        )
        return {
            path: {each.kind: each.as_json() for each in kinds} for path, kinds in counted if kinds
        }

    def as_json(self) -> dict[str, Any]:
        """Everything, in the spelling that other programs rely on; times in us where named so."""
        models = {path: self._model(index) for index, path in enumerate(self.layout.models)}
        deadlines = self._deadlines()
        return {
            "schema": SCHEMA,
            **{total: sum(model[total] for model in models.values()) for total in TOTALS},
            "deadline_misses": {name: each["misses"] for name, each in deadlines.items()},
            "deadlines": deadlines,
            "lateness_us": self.lateness().summary_us(),
            "step_us": self.step_times().summary_us(),
            "models": models,
            "bus": {name: self._bus(index) for index, name in enumerate(self.layout.buses)},
            "faults": self.faults(),
            "worst": self._worst(),
            "conditions": {**self._conditions(), "run": self._run()},
        }

    def _model(self, index: int) -> dict[str, Any]:
        first = self.layout.model(index)
        fields = self._fields(first, MODEL)
        is_known = fields["overruns"] > 0 and fields["last_late_ns"] != NO_INSTANT
        stated = self.header["models"][self.layout.models[index]]
        period_ns = stated["period_ns"]
        own_time = self.own_time_of(index)
        return {
            **{total: fields[total] for total in TOTALS},
            "last_late_t_ns": fields["last_late_ns"] if is_known else None,
            "kind": "event" if period_ns is None else "periodic",
            "period_us": None if period_ns is None else period_ns / 1000,
            "tolerance_us": stated["tolerance_ns"] / 1000,
            "policy": stated["policy"],
            "waiting": self._waiting(index),
            "reactions": fields["reactions"],
            "irregular": fields["irregular"],
            "returned_after_us": fields["returned_ns"] / 1000 if fields["irregular"] > 0 else None,
            "lateness_us": self.lateness_of(index).summary_us(),
            "step_us": own_time.summary_us(),
            "load": self._share(own_time.sum) if own_time.sum > 0 else None,
        }

    def _waiting(self, index: int) -> int:
        if not self.writer_alive:
            return 0
        return waiting(self.cells, self.layout, self.header, index)

    def _measured(self, histogram: slice) -> Histogram:
        """What was measured; in virtual time, in which a step takes none, nothing was."""
        return Histogram(empty_cells() if self.is_virtual else self.cells[histogram])

    def _bus(self, index: int) -> dict[str, Any]:
        counters = self._fields(self.layout.bus(index), BUS)
        busy_ns = counters.pop("busy_ns")
        return {**counters, "utilisation": self._share(busy_ns)}

    def _share(self, spent_ns: int) -> float | None:
        """A part of the time of the run; None at its very start."""
        return spent_ns / self.cells[ELAPSED] if self.cells[ELAPSED] > 0 else None

    def _deadlines(self) -> dict[str, dict[str, int]]:
        return {
            name: self._fields(self.layout.deadline(index), DEADLINE)
            for index, name in enumerate(self.layout.deadlines)
        }

    def _worst(self) -> list[dict[str, Any]]:
        places = [self._place(index) for index in range(self.layout.worst)]
        taken = [place for place in places if place["lateness_us"] + place["step_us"] > 0]
        return sorted(taken, key=lambda place: -(place["lateness_us"] + place["step_us"]))

    def _place(self, index: int) -> dict[str, Any]:
        first = self.layout.place(index)
        entry = self._fields(first, WORST)
        own_time = first + len(WORST)
        devices = own_time + len(self.layout.timed)
        return {
            "t_ns": entry["t_ns"],
            "model": self.layout.models[entry["model"]] if self.layout.models else None,
            "lateness_us": entry["lateness_ns"] / 1000,
            "step_us": entry["step_ns"] / 1000,
            "causes": {
                "wake_us": entry["wake_ns"] / 1000,
                "behind_us": entry["behind_ns"] / 1000,
                "garbage_us": entry["garbage_ns"] / 1000,
                "bus_us": {
                    bus: self._devices(devices + number * 2 * DEVICES)
                    for number, bus in enumerate(self.layout.buses)
                },
                "models_us": {
                    path: self.cells[own_time + number] / 1000
                    for number, path in enumerate(self.layout.timed)
                    if self.cells[own_time + number] > 0
                },
            },
        }

    def _devices(self, first: int) -> dict[str, float]:
        addresses = self.cells[first : first + DEVICES]
        busy = self.cells[first + DEVICES : first + 2 * DEVICES]
        return {
            f"0x{address:02x}": spent / 1000
            for address, spent in zip(addresses, busy, strict=True)
            if spent > 0
        }

    def _conditions(self) -> dict[str, Any]:
        return as_they_hold(self.header["conditions"], self.cells[YIELDED])

    def _run(self) -> dict[str, Any]:
        state = self.state
        died = state is RunState.RUNNING and not self.writer_alive
        return {
            "state": "died" if died else state.name.lower(),
            "reason": self.reason,
            "complete": self.complete,
            "elapsed_s": self.cells[ELAPSED] / 1e9,
            "steps": self.cells[STEPS],
            "inputs_dropped": self.cells[INPUTS_DROPPED],
            "overloaded_s": self.cells[YIELDED] / 1e9 if self.cells[YIELDED] > 0 else None,
            "armed": bool(self.cells[ARMED]) and not died,
            "guarded": self._is_guarded(),
            "cpu_s": self.cells[CPU] / 1e9 if self.cells[CPU] > 0 else None,
        }

    def _is_guarded(self) -> bool:
        """Whether a guard's last sign is less than a second older than the loop's."""
        guard = self.cells[GUARD]
        return guard > 0 and self.cells[HEARTBEAT] - guard < SECOND

    def _fields(self, first: int, names: tuple[str, ...]) -> dict[str, int]:
        return dict(zip(names, self.cells[first : first + len(names)], strict=True))
