"""Which evidence makes which cause of a late activation: all rules, in one table.

What is to be explained is `of_ns`: the lateness, and what the step took longer than is usual. Each
rule says how much of it one cause explains, in ns, as far as the counters go; all of them only
where they grew by more than is usual for so many steps. A cause is named if it explains at least
`ENOUGH` of it. Of several, the first of the table is named: it stands from the particular to the
general, and the particular is a part of the general (throttling is time in which the loop could
run, garbage and page faults are processor time of a model). If none explains enough, the cause is
unknown; so it is where the counter that would show it is not measured.

A counter has grown since a reading that may lie a second back, and steps since then may have been
slow and yet on time. What they took beyond the usual, `others_ns`, may be theirs in any counter: it
is taken off each (`_own`).
"""

from collections.abc import Callable

from msgspec import Struct

from firmware_runtime.executive.blame.usual import WAKE_NS
from firmware_runtime.statistics.blame import Cause
from firmware_runtime.system.thread_counters import TICK_NS

ENOUGH = 0.6
"""The share that a cause must explain."""
FETCHED_NS = 50_000
"""What a page that comes from a disk takes at least, of a quick one."""
REQUESTED_NS = 10_000
"""What it computes for it at least: the request, the interrupt at its end, two switches."""
DEARER = 3
"""By what factor a fault may take longer than it was measured to: caches, a host that faults."""
DISK_GRAIN_NS = 1_000_000
"""Disks are timed in ms."""
SLOWER = 0.9
"""A clock at less than this of what it was has stepped down."""
UNSEEN_NS = 3 * TICK_NS
"""A host or interrupts that delay a waking for so long are seen in their ticks."""
LOCK_NS = 4_000_000
"""A thread that computes keeps the interpreter's lock for 5 ms (`sys.getswitchinterval`), less what
the counters may be off."""
LOCK_SLEEPS = 2
"""One that waits for it goes to sleep at once, and again after it has asked for it."""
HELD_DOWN = 4
"""By what factor the firmware of a Raspberry Pi slows it at most: 2400 to 600 MHz."""


class Evidence(Struct, frozen=True, kw_only=True):
    """Of one late activation or long step, beyond what is usual; None: not measured. Times in ns.

    In `before_wait_ns`, after the deadline and the step before it, the loop had not come to its
    wait yet; `in_step_ns` is what the step took longer than usual. `model` is the one that took the
    most beyond its usual time, `device` the one that had its bus the longest. `others_ns` is what
    steps before this one took beyond the usual since the counters were read, `usual_cpu_ns` the
    processor time of a step.
    """

    of_ns: int
    others_ns: int = 0
    before_wait_ns: int = 0
    in_step_ns: int = 0
    cpu_ns: int = 0
    usual_cpu_ns: int = 0
    other_threads_ns: int = 0
    run_delay_ns: int | None = None
    throttled_ns: int | None = None
    throttlings: int | None = None
    stolen_ns: int | None = None
    interrupt_ns: int | None = None
    disk_wait_ns: int | None = None
    disks_ns: int | None = None
    garbage_ns: int = 0
    bus_ns: int = 0
    faults_ns: int | None = None
    stops: int | None = None
    minor_faults: int = 0
    major_faults: int = 0
    voluntary: int = 0
    may_have_slept: bool = True
    is_traced: bool = False
    involuntary: int = 0
    interrupts: int | None = None
    retries: int = 0
    read_bytes: int | None = None
    written_bytes: int | None = None
    was_moved: bool = False
    was_regrouped: bool = False
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

    @property
    def slept_ns(self) -> int | None:
        """The same, of its own accord; without a switch for that, its host may have had it.

        One that a tracer has now may have been halted by it.
        """
        return self.asleep_ns if self.may_have_slept and not self.is_traced else 0


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
    """It was let go on, and the thread was asleep; what it was asleep for otherwise is known."""
    return of.asleep_ns if of.stops else 0


def _moved(of: Evidence) -> int | None:
    """The set of processors was changed, and the loop then waited for its turn."""
    return _preempted(of) if of.was_moved else 0


def _throttled(of: Evidence) -> int | None:
    """A thread held back could run and does not; the rest of that time is others' of its group.

    From Linux 6.18 on one that wakes up into a group held back counts as asleep, and the group's
    time does not grow: then what it seems to have slept before the step, if a quota was used up.
    """
    held_back = _own(of, of.throttled_ns)
    if of.run_delay_ns is not None:
        held_back = min(held_back, _own(of, of.run_delay_ns))
    slept = min(of.asleep_ns or 0, of.of_ns - of.in_step_ns - (of.stolen_ns or 0))
    return max(held_back, slept if of.throttlings and slept >= UNSEEN_NS else 0)


def _garbage(of: Evidence) -> int | None:
    """Without what it may have waited for its processor: a collection, too, can lose that."""
    return of.garbage_ns - (of.run_delay_ns or 0)


def _bus(of: Evidence) -> int | None:
    """Its computed time, of what the step was asleep; with retries, all that it was asleep.

    An adapter does not compute, and before the step it was not asked.
    """
    asleep = of.in_step_ns if of.slept_ns is None else min(of.slept_ns, of.in_step_ns)
    return asleep if of.retries > 0 else min(of.bus_ns, asleep)


def _faults(of: Evidence) -> int | None:
    """By what one fault was measured to take; with I/O, what the thread was asleep for them."""
    asleep = _asleep_for_a_disk(of) if of.major_faults > 0 else 0
    computed = min((of.faults_ns or 0) + of.major_faults * REQUESTED_NS, of.cpu_ns)
    found = max(_own(of, computed) + asleep, _own(of, of.major_faults * FETCHED_NS))
    return min(found, of.in_step_ns + of.before_wait_ns)


def _disk(of: Evidence) -> int | None:
    """The kernel's account of it; else what a step was asleep in which bytes went to a disk."""
    asleep = min(_asleep_for_a_disk(of), of.in_step_ns) if _moved_bytes(of) else 0
    return max(_own(of, of.disk_wait_ns), asleep)


def _moved_bytes(of: Evidence) -> bool:
    return bool(of.read_bytes or of.written_bytes)


def _asleep_for_a_disk(of: Evidence) -> int:
    """At most what the requests to a disk took, and waking after each; none if there were none."""
    if not of.disks_ns:
        return 0
    return min(of.slept_ns or 0, of.disks_ns + DISK_GRAIN_NS + of.voluntary * WAKE_NS)


def _interrupts(of: Evidence) -> int | None:
    """Ticks that are mostly sampled: two may come by chance. Not while something else ran."""
    ticks = _own(of, of.interrupt_ns) - 2 * TICK_NS
    return min(ticks, of.of_ns - (of.run_delay_ns or 0))


def _stolen(of: Evidence) -> int | None:
    """Ticks of a time that is exact: so many and one less have certainly passed.

    The thread's own counters leave it out, so it is a part of the time it seems to be asleep.
    """
    return min(_own(of, of.stolen_ns) - TICK_NS, of.asleep_ns or 0)


def _preempted(of: Evidence) -> int | None:
    """Unless it may have been held back by a quota: of groups it has just come into."""
    return 0 if of.was_regrouped else _own(of, of.run_delay_ns)


def _running(of: Evidence) -> int:
    """What the thread itself computed in the step beyond what is usual."""
    return min(_own(of, of.cpu_ns), of.in_step_ns)


def _supply(of: Evidence) -> int | None:
    """As much as the usual work takes longer at the slowest clock."""
    return min(_running(of), of.usual_cpu_ns * (HELD_DOWN - 1)) if of.supply else 0


def _clock(of: Evidence) -> int | None:
    """At a lower clock the usual work takes longer: by the ratio of the two."""
    if not of.khz or not of.khz_before or of.khz >= SLOWER * of.khz_before:
        return 0
    return min(_running(of), of.usual_cpu_ns * (of.khz_before - of.khz) // of.khz)


def _model(of: Evidence) -> int | None:
    """Without what faults may have taken at most: then it is neither's."""
    return _running(of) - DEARER * (of.faults_ns or 0)


def _another_thread(of: Evidence) -> int | None:
    """What others of the process ran, of what this one slept waiting for the interpreter's lock.

    That wait goes to sleep again when it is over time; a waking that comes late does not. A shorter
    one, or one without that, may be the host's.
    """
    asleep = of.asleep_ns or 0
    if of.voluntary < LOCK_SLEEPS or asleep < LOCK_NS or of.is_traced:
        return 0
    return min(_own(of, of.other_threads_ns), asleep)


def _asleep(of: Evidence) -> int | None:
    """For nothing that is measured; where disks are not, and bytes moved, nothing follows."""
    if of.disks_ns is None and (_moved_bytes(of) or of.major_faults > 0):
        return 0
    return min(of.slept_ns or 0, of.in_step_ns)


def _between(of: Evidence) -> int | None:
    """The loop came late to its wait, and ran: hooks of the run, work in the slack."""
    return min(of.before_wait_ns, _own(of, of.cpu_ns))


def _own(of: Evidence, counted: int | None) -> int:
    """Of what a counter grew by, what is certainly this step's."""
    return max((counted or 0) - of.others_ns, 0)


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
    (Cause.ANOTHER_THREAD, _another_thread),
    (Cause.ASLEEP, _asleep),
    (Cause.BETWEEN, _between),
)
"""From the particular to the general; each function gives the ns that its cause explains."""
