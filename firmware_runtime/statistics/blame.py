"""Causes of lateness: their names, and what a file keeps of one verdict.

Which evidence makes which cause is decided where it is collected (`executive.blame`). A file's
header names its causes and the cells of a verdict, so that a reader of another version finds both;
a file from before there were verdicts has neither.
"""

from collections.abc import Iterable, Mapping
from enum import StrEnum

from msgspec import Struct

from firmware_runtime.statistics.layout import Layout
from firmware_runtime.statistics.number_formats import microseconds

NOT_MEASURED = -1
"""In a cell of evidence; no counter grows by that."""


class Cause(StrEnum):
    """One word or two for what took the time, as statistics, journal and metrics have it."""

    UNKNOWN = "unknown"
    STOPPED = "stopped"
    MOVED = "moved"
    THROTTLED = "throttled"
    GARBAGE = "garbage"
    BUS = "bus"
    FAULTS = "page faults"
    DISK = "disk"
    INTERRUPTS = "interrupts"
    STOLEN = "host"
    PREEMPTED = "processor taken"
    SUPPLY = "supply or heat"
    CLOCK = "clock speed"
    MODEL = "model"
    ANOTHER_THREAD = "another thread"
    ASLEEP = "model asleep"
    BETWEEN = "between steps"


ABOUT: Mapping[str, str] = {
    Cause.UNKNOWN: "nothing that is measured explains it",
    Cause.STOPPED: "the process was stopped (SIGSTOP) and let go on",
    Cause.MOVED: "the loop was moved to another processor, and waited for it",
    Cause.THROTTLED: "the control group had used up its quota of processor time",
    Cause.GARBAGE: "garbage was collected",
    Cause.BUS: "a device kept its bus busy, or had to be asked again",
    Cause.FAULTS: "pages of memory had to be fetched",
    Cause.DISK: "a disk was waited for",
    Cause.INTERRUPTS: "the processor was busy with interrupts",
    Cause.STOLEN: "the host of this virtual machine ran something else",
    Cause.PREEMPTED: "the loop could run, and something else had the processor",
    Cause.SUPPLY: "too little voltage or too much heat held the clock down",
    Cause.CLOCK: "the processor's clock had stepped down",
    Cause.MODEL: "the model's own code took the time",
    Cause.ANOTHER_THREAD: "another thread of the process had the interpreter's lock",
    Cause.ASLEEP: "the model waited in its own code, for nothing that is measured",
    Cause.BETWEEN: "work between the steps took the time",
}
CAUSES = tuple(each.value for each in Cause)


class BlameRow(Struct, frozen=True):
    """Cells of one verdict; evidence is what counters grew by beyond what is usual.

    `cause` is the number of one of the file's causes, from 1 on; 0: there was nothing to explain.
    `culprit` is the number of a model, or of a bus and its device (`bus << 8 | address`).
    """

    cause: int = 0
    culprit: int = NOT_MEASURED
    explained_ns: int = 0
    of_ns: int = 0
    run_delay_ns: int = NOT_MEASURED
    throttled_ns: int = NOT_MEASURED
    stolen_ns: int = NOT_MEASURED
    interrupt_ns: int = NOT_MEASURED
    cpu_ns: int = NOT_MEASURED
    asleep_ns: int = NOT_MEASURED
    garbage_ns: int = NOT_MEASURED
    faults_ns: int = NOT_MEASURED
    bus_ns: int = NOT_MEASURED
    disk_wait_ns: int = NOT_MEASURED
    stops: int = NOT_MEASURED
    minor_faults: int = NOT_MEASURED
    major_faults: int = NOT_MEASURED
    voluntary: int = NOT_MEASURED
    involuntary: int = NOT_MEASURED
    interrupts: int = NOT_MEASURED
    retries: int = NOT_MEASURED
    read_bytes: int = NOT_MEASURED
    written_bytes: int = NOT_MEASURED
    from_cpu: int = NOT_MEASURED
    to_cpu: int = NOT_MEASURED
    moved: int = NOT_MEASURED
    khz_before: int = NOT_MEASURED
    khz: int = NOT_MEASURED
    supply: int = NOT_MEASURED
    disks_ns: int = NOT_MEASURED
    others_ns: int = NOT_MEASURED
    throttlings: int = NOT_MEASURED
    other_threads_ns: int = NOT_MEASURED


BLAME = BlameRow.__struct_fields__
NOTHING = BlameRow()
"""Of a step that is not judged."""
_VERDICT = ("cause", "culprit", "explained_ns", "of_ns")


class Blame(Struct, frozen=True):
    """A verdict as it is reported; a part of the evidence that was not measured is None."""

    cause: str
    culprit: str | None
    """The model, or bus and address of the device; None where the cause is no part of the robot."""
    explained_us: float
    of_us: float
    """How much of how much the cause explains: the lateness and what the step took too long."""
    evidence: dict[str, float | None]

    @property
    def share(self) -> float:
        """Share that is explained, 0 to 1."""
        return min(self.explained_us / self.of_us, 1.0) if self.of_us > 0 else 0.0


class VerdictInWords(Struct, frozen=True):
    """What of a verdict is said in a sentence."""

    cause: str
    culprit: str | None
    """The model, or bus and address of the device; None where the cause is no part of the robot."""
    explained_us: float
    of_us: float


def read_blame(cells: Iterable[int], names: Layout) -> Blame | None:
    """The verdict in a place of the file; None where there was nothing to explain."""
    found = dict(zip(names.blame, cells, strict=True))
    number = found.get("cause", 0)
    if not 0 < number <= len(names.causes):
        return None
    cause = names.causes[number - 1]
    return Blame(
        cause,
        _culprit(cause, found.get("culprit", NOT_MEASURED), names),
        found.get("explained_ns", 0) / 1000,
        found.get("of_ns", 0) / 1000,
        dict(_evidence(name, value) for name, value in found.items() if name not in _VERDICT),
    )


def verdict_of(row: BlameRow, names: Layout) -> VerdictInWords | None:
    """A verdict that has just been made; None where there was nothing to explain."""
    if not 0 < row.cause <= len(names.causes):
        return None
    cause = names.causes[row.cause - 1]
    culprit = _culprit(cause, row.culprit, names)
    return VerdictInWords(cause, culprit, row.explained_ns / 1000, row.of_ns / 1000)


def sentence(blame: Blame | VerdictInWords) -> str:
    """A verdict in a few words: `processor taken, 3.10 ms of 3.20 ms`."""
    if blame.cause == Cause.UNKNOWN:
        return f"{blame.cause}, {microseconds(blame.of_us)}"
    who = "" if blame.culprit is None else f" {blame.culprit}"
    return f"{blame.cause}{who}, {microseconds(blame.explained_us)} of {microseconds(blame.of_us)}"


def _evidence(name: str, value: int) -> tuple[str, float | None]:
    """Nanoseconds as microseconds; counts as they are."""
    shown = f"{name.removesuffix('_ns')}_us" if name.endswith("_ns") else name
    if value == NOT_MEASURED:
        return shown, None
    return shown, value / 1000 if name.endswith("_ns") else value


def _culprit(cause: str, number: int, names: Layout) -> str | None:
    if number < 0:
        return None
    if cause == Cause.BUS:
        bus, address = number >> 8, number & 0xFF
        return f"{names.buses[bus]} 0x{address:02x}" if bus < len(names.buses) else None
    return names.models[number] if number < len(names.models) else None
