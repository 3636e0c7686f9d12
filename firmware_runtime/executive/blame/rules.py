"""Which evidence makes which cause of a late activation: all rules, in one table.

What is to be explained is `of_ns`: the lateness, and what the step took longer than is usual. Each
rule says how much of it one cause explains, in ns, as far as the counters go; all of them only
where they grew by more than is usual for so many steps. A cause is named if it explains at least
`ENOUGH` of it. Of several, the first of the table is named: it stands from the particular to the
general, and the particular is a part of the general (throttling is time in which the loop could
run, garbage and page faults are processor time of a model). If none explains enough, the cause is
unknown; so it is where the counter that would show it is not measured.
"""

from collections.abc import Callable

from msgspec import Struct

from firmware_runtime.statistics.blame import Cause
from firmware_runtime.system.thread_counters import TICK_NS

ENOUGH = 0.6
"""The share that a cause must explain."""
FETCHED_NS = 50_000
"""What a page that comes from a disk takes at least, of a quick one."""
SLOWER = 0.9
"""A clock at less than this of what it was has stepped down."""


class Evidence(Struct, frozen=True, kw_only=True):
    """Of one late activation or long step, beyond what is usual; None: not measured. Times in ns.

    In `before_wait_ns`, after the deadline and the step before it, the loop had not come to its
    wait yet; `in_step_ns` is what the step took longer than usual. `model` is the one that took the
    most beyond its usual time, `device` the one that had its bus the longest.
    """

    of_ns: int
    before_wait_ns: int = 0
    in_step_ns: int = 0
    cpu_ns: int = 0
    run_delay_ns: int | None = None
    throttled_ns: int | None = None
    stolen_ns: int | None = None
    interrupt_ns: int | None = None
    disk_wait_ns: int | None = None
    garbage_ns: int = 0
    bus_ns: int = 0
    faults_ns: int | None = None
    stops: int | None = None
    minor_faults: int = 0
    major_faults: int = 0
    voluntary: int = 0
    involuntary: int = 0
    interrupts: int | None = None
    retries: int = 0
    read_bytes: int | None = None
    written_bytes: int | None = None
    was_moved: bool = False
    from_cpu: int = 0
    to_cpu: int = 0
    khz_before: int | None = None
    khz: int | None = None
    supply: int | None = None
    model: int = -1
    device: int = -1

    @property
    def asleep_ns(self) -> int | None:
        """Time in which the thread neither ran nor could run; None where the latter is unknown."""
        if self.run_delay_ns is None:
            return None
        return max(self.of_ns - self.cpu_ns - self.run_delay_ns, 0)


class Verdict(Struct, frozen=True):
    """A cause, how much of the time it explains, and the part of the robot that it names."""

    cause: Cause = Cause.UNKNOWN
    explained_ns: int = 0
    culprit: int = -1


def verdict(evidence: Evidence) -> Verdict:
    """The cause of a late activation by the rules above."""
    for cause, explains in RULES:
        explained = min(explains(evidence) or 0, evidence.of_ns)
        if explained > 0 and explained >= ENOUGH * evidence.of_ns:
            return Verdict(cause, explained, _culprit(cause, evidence))
    return Verdict()


def _culprit(cause: Cause, evidence: Evidence) -> int:
    if cause is Cause.BUS:
        return evidence.device
    return evidence.model if cause in {Cause.MODEL, Cause.ASLEEP, Cause.DISK} else -1


def _stopped(of: Evidence) -> int | None:
    """SIGCONT came, and the thread was asleep; what it was asleep for otherwise is known."""
    return of.asleep_ns if of.stops else 0


def _moved(of: Evidence) -> int | None:
    """The set of processors was changed, and the loop then waited for its turn."""
    return of.run_delay_ns if of.was_moved else 0


def _throttled(of: Evidence) -> int | None:
    return of.throttled_ns


def _garbage(of: Evidence) -> int | None:
    """Without what it may have waited for its processor: a collection, too, can lose that."""
    return of.garbage_ns - (of.run_delay_ns or 0)


def _bus(of: Evidence) -> int | None:
    """Its computed time; with retries, all that the step was asleep: adapters do not compute."""
    asleep = min(of.asleep_ns or 0, of.in_step_ns) if of.retries > 0 else 0
    return max(of.bus_ns, asleep)


def _faults(of: Evidence) -> int | None:
    """By what one fault was measured to take; with I/O, what the thread was asleep for them."""
    asleep = (of.asleep_ns or 0) if of.major_faults > 0 else 0
    return max((of.faults_ns or 0) + asleep, of.major_faults * FETCHED_NS)


def _disk(of: Evidence) -> int | None:
    """The kernel's account of it; else what a step was asleep in which bytes went to a disk."""
    moved_bytes = (of.read_bytes or 0) + (of.written_bytes or 0)
    asleep = min(of.asleep_ns or 0, of.in_step_ns) if moved_bytes > 0 else 0
    return max(of.disk_wait_ns or 0, asleep)


def _interrupts(of: Evidence) -> int | None:
    """Ticks that are mostly sampled: two may come by chance."""
    return max((of.interrupt_ns or 0) - 2 * TICK_NS, 0)


def _stolen(of: Evidence) -> int | None:
    """Ticks of a time that is exact: so many and one less have certainly passed."""
    return max((of.stolen_ns or 0) - TICK_NS, 0)


def _preempted(of: Evidence) -> int | None:
    return of.run_delay_ns


def _running(of: Evidence) -> int:
    """What the thread itself computed in the step beyond what is usual."""
    return min(of.cpu_ns, of.in_step_ns)


def _supply(of: Evidence) -> int | None:
    return _running(of) if of.supply else 0


def _clock(of: Evidence) -> int | None:
    """At a lower clock the same work takes longer: by the ratio of the two."""
    if of.khz is None or not of.khz_before or of.khz >= SLOWER * of.khz_before:
        return 0
    return _running(of)


def _model(of: Evidence) -> int | None:
    return _running(of)


def _asleep(of: Evidence) -> int | None:
    return min(of.asleep_ns or 0, of.in_step_ns)


def _between(of: Evidence) -> int | None:
    """The loop came late to its wait, and ran: hooks of the run, work in the slack."""
    return min(of.before_wait_ns, of.cpu_ns)


RULES: tuple[tuple[Cause, Callable[[Evidence], int | None]], ...] = (
    (Cause.STOPPED, _stopped),
    (Cause.GARBAGE, _garbage),
    (Cause.THROTTLED, _throttled),
    (Cause.MOVED, _moved),
    (Cause.PREEMPTED, _preempted),
    (Cause.BUS, _bus),
    (Cause.FAULTS, _faults),
    (Cause.DISK, _disk),
    (Cause.INTERRUPTS, _interrupts),
    (Cause.STOLEN, _stolen),
    (Cause.SUPPLY, _supply),
    (Cause.CLOCK, _clock),
    (Cause.MODEL, _model),
    (Cause.ASLEEP, _asleep),
    (Cause.BETWEEN, _between),
)
"""From the particular to the general; each function gives the ns that its cause explains."""
