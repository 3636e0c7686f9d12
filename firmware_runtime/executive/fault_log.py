"""Every fault that leaves a model, counted by model and kind, whether or not its port is coupled.

A value that a model misses since it is not finite (`devs.finite`) is a fault of it, too.
Built on listening: an output port whose values are faults is listened to, so a step without faults
costs nothing. During a step a fault is noted here; the ledger has it written after it.
"""

from functools import partial
from typing import Any

from msgspec import field

from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.finite import check_of
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.time import kept
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.statistics import fault_table
from firmware_runtime.statistics.fault_table import KINDS, OTHER_KINDS, FaultCount
from firmware_runtime.statistics.histogram import Cells, empty_cells
from firmware_runtime.statistics.layout import Layout

NOT_FINITE = "NotFinite"


class CountedFault(FaultCount, kw_only=True):
    """One kind of fault of the model at `path`, with its row in the statistics file."""

    path: str
    cells: Cells = field(default_factory=partial(empty_cells, fault_table.ROW_CELLS))
    is_in_new_words: bool = True


class FaultLog:
    """The faults of one run; `counted` has an entry for each kind of each model, as they came.

    `pending` is true while something was noted that is not in the file yet.
    """

    def __init__(self, simulator: Engine) -> None:
        self.counted: list[CountedFault] = []
        self.pending: list[CountedFault] = []
        paths: list[str] = []
        self._refusing: dict[InPort[Any], int] = {}
        """The number in `models` for each port that may refuse a value."""
        for atomic in simulator.atomics:
            ports = [port for port in atomic.out_ports.values() if carries_faults(port)]
            for port in ports:
                simulator.listen(port, partial(self._note, len(paths)))
            refusing = [port for port in atomic.in_ports.values() if check_of(port) is not None]
            self._refusing.update(dict.fromkeys(refusing, len(paths)))
            if ports or refusing:
                paths.append(below_root(atomic.path))
        self._simulator = simulator
        simulator.on_refused = self._note_refused
        self.models = tuple(paths)
        """Those that have a port for faults, or one that may refuse a value, by path."""
        self._by_kind: list[dict[str, CountedFault]] = [{} for _ in paths]
        self._block = empty_cells(len(paths) * fault_table.MODEL_CELLS)

    def count_in(self, cells: Cells, layout: Layout) -> None:
        """From now on, count in the statistics file."""
        self._block = cells[layout.faults]

    def _note(self, number: int, at: int, fault: Fault) -> None:
        """Count one fault of a model, given by its number in `models`."""
        counted = self._by_kind[number].get(fault.kind) or self._open(number, fault.kind)
        if counted.count == 0:
            counted.first_at = at
        counted.count += 1
        counted.last_at = at
        if counted.sentence != fault.reason:
            counted.sentence = fault.reason
            counted.is_in_new_words = True
        self.pending.append(counted)

    def _note_refused(self, port: InPort[Any], value: object) -> None:
        """Count a value that is not finite as a fault of the model that misses it."""
        sentence = f"{port.path}: {value!r}, expected finite numbers; it counts as missing"
        self._note(self._refusing[port], self._simulator.now, Fault(NOT_FINITE, sentence, 1))

    def state(self) -> list[tuple[Any, ...]]:
        """Each kind of each model as it was counted, in the order in which they came."""
        names = {path: number for number, path in enumerate(self.models)}
        return [
            (names[each.path], each.kind, each.count, each.first_at, each.last_at, each.sentence)
            for each in self.counted
        ]

    def restore(self, state: list[tuple[Any, ...]]) -> None:
        """Have counted that, in the file as well."""
        self.counted.clear()
        self.pending.clear()
        for kinds in self._by_kind:
            kinds.clear()
        self._block[:] = empty_cells(len(self._block))
        for number, kind, *counts in state:
            *numbers, sentence = counts
            counted = self._open(number, str(kind))
            counted.count, counted.first_at, counted.last_at = map(kept, numbers)
            counted.sentence = str(sentence)
        self.pending += self.counted
        self.write()

    def write(self) -> None:
        """Move what was noted into the file; within a section."""
        for counted in self.pending:
            if counted.cells[0] == 0:
                fault_table.write(counted.cells, counted)
            else:
                fault_table.write_again(
                    counted.cells, counted, in_new_words=counted.is_in_new_words
                )
            counted.is_in_new_words = False
        self.pending.clear()

    def last_of(self, path: str) -> CountedFault | None:
        """The kind of fault that a model reported last; None if it reported none."""
        own = [counted for counted in self.counted if counted.path == path]
        return max(own, key=lambda counted: counted.last_at, default=None)

    def _open(self, number: int, kind: str) -> CountedFault:
        """An entry for a kind that has none in these words; a new row, as long as there is one."""
        kinds, kind = self._by_kind[number], fault_table.kept_kind(kind)
        if kind not in kinds and len(kinds) >= KINDS:
            kind = OTHER_KINDS
        if kind in kinds:
            return kinds[kind]
        counted = kinds[kind] = CountedFault(kind, path=self.models[number])
        counted.cells = fault_table.row(self._block, number, len(kinds) - 1)
        self.counted.append(counted)
        return counted


def carries_faults(port: OutPort[Any]) -> bool:
    """Return whether the values of a port are faults."""
    kind: object = port.type  # anything, whatever its annotation says
    return isinstance(kind, type) and issubclass(kind, Fault)
