"""Faults in the journal: a new kind at once, one that goes on in a line every ten seconds."""

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.executive.fault_log import CountedFault, FaultLog
from firmware_runtime.system.journal import WARNING, Journal

AGAIN_AFTER = 10 * SECOND
"""Ns from one line on a kind of fault of a model to the next."""


class _Kind:
    """One kind of fault of one model, and how much of it has been written."""

    def __init__(self, counted: CountedFault) -> None:
        self.counted = counted
        self.written = 0
        self.again_at = 0


class FaultJournal:
    """Writes what a run's fault log counts."""

    def __init__(self, faults: FaultLog, journal: Journal) -> None:
        self._counted = faults.counted
        self._journal = journal
        self._kinds: list[_Kind] = []

    def attend(self, now: int) -> None:
        """Write what is new, as far as its time has come."""
        if len(self._kinds) < len(self._counted):
            self._kinds += map(_Kind, self._counted[len(self._kinds) :])
        for kind in self._kinds:
            if kind.written < kind.counted.count and now >= kind.again_at:
                kind.again_at = now + AGAIN_AFTER
                self._write(kind)

    def close(self) -> None:
        """Write what is new, whenever its time would come."""
        self.attend(NEVER)

    def _write(self, kind: _Kind) -> None:
        counted = kind.counted
        new, kind.written = counted.count - kind.written, counted.count
        many = "" if new == 1 else f" ({new} times since the last line)"
        self._journal.write(
            f"{counted.path}: {counted.kind}: {counted.sentence}{many}",
            WARNING,
            MODEL=counted.path,
            FAULT=counted.kind,
            COUNT=counted.count,
        )
