"""Limits on the timing of one run, judged: kept, broken, or cannot tell here.

Neighbours, a host and a kernel without real-time priority make a run late, never early. So limits
that are kept are kept, wherever the run was; limits that are broken are its fault only where
nothing else may have been the cause; and what was not measured is neither.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

from firmware_runtime.errors import ConfigError, did_you_mean
from firmware_runtime.statistics.blame import Cause
from firmware_runtime.statistics.figures import Activations, Figures, ModelFigures
from firmware_runtime.statistics.file_header import Conditions
from firmware_runtime.statistics.number_formats import microseconds

SAMPLES_OF_P99 = 100
"""With fewer activations the largest of all stands for the 99th percentile."""
_MACHINES = (
    *(Cause.STOPPED, Cause.MOVED, Cause.THROTTLED, Cause.INTERRUPTS),
    *(Cause.STOLEN, Cause.PREEMPTED, Cause.SUPPLY, Cause.CLOCK),
)
"""Causes of a late step that are neither the model's nor the board's."""
_REAL_TIME = ("SCHED_FIFO", "SCHED_RR")


class Judgement(StrEnum):
    """Judgement of a run."""

    KEPT = "kept"
    BROKEN = "broken"
    CANNOT_TELL = "cannot tell here"


@dataclass(frozen=True, slots=True)
class Limits:
    """Each at most, None where there is none; times in us, of one model or of all."""

    p99_us: float | None = None
    """Lateness of 99 in 100 activations."""
    max_us: float | None = None
    """Lateness of any activation."""
    step_p99_us: float | None = None
    """Execution time: of whole steps, or the model's own."""
    step_max_us: float | None = None
    skips: int | None = None
    """Activations that were skipped or coalesced: all that did not run."""
    overruns: int | None = None
    misses: int | None = None
    """Deadlines from one model to another that were missed."""
    model: str | None = None
    """Path of the model that is meant, as `stats` shows it."""


@dataclass(frozen=True, slots=True)
class Judged:
    """The judgement; sentences on what was broken, what was not measured, and what may be why."""

    judgement: Judgement
    broken: Sequence[str]
    unmeasured: Sequence[str]
    reasons: Sequence[str]

    def __str__(self) -> str:
        """In lines, the judgement first."""
        lines = [f"timing limits: {self.judgement}"]
        lines += [f"  {each}" for each in (*self.broken, *self.unmeasured)]
        if self.broken and self.judgement is Judgement.CANNOT_TELL:
            lines.append("which may be no fault of the run:")
        lines += [f"  {each}" for each in self.reasons]
        return "\n".join(lines)


def judge(
    figures: Figures, limits: Limits, others: Sequence[str] = (), *, strict: bool = False
) -> Judged:
    """Judge a run; `others` are further reasons, of what was seen of the machine meanwhile.

    When strict, what is broken or not measured is broken, whatever the conditions. Raises
    ConfigError for limits that are none, and a model that is not there.
    """
    _demand_sound(figures, limits)
    of: Figures | ModelFigures = figures if limits.model is None else figures.models[limits.model]
    broken = [*_late(of, limits), *_counted(figures, of, limits)]
    unmeasured = list(_unmeasured(figures, of, limits))
    reasons = [*others, *reasons_of(figures)] if broken else []
    judgement = Judgement.KEPT
    if broken or unmeasured:
        is_certain = strict or (broken and not unmeasured and not reasons)
        judgement = Judgement.BROKEN if is_certain else Judgement.CANNOT_TELL
    return Judged(judgement, broken, unmeasured, reasons)


def reasons_of(figures: Figures) -> list[str]:
    """Return reasons for which this run may be late through no fault of its own."""
    conditions = figures.conditions
    return [*_causes(figures), *_scheduling(conditions), *_machine(conditions)]


# -------------------------------------------------------------------------------------------------


def _late(of: Figures | ModelFigures, limits: Limits) -> Iterator[str]:
    for what, found, most in (
        ("lateness p99", of.lateness_us.p99, limits.p99_us),
        ("lateness at most", of.lateness_us.max, limits.max_us),
        ("execution time p99", of.step_us.p99, limits.step_p99_us),
        ("execution time at most", of.step_us.max, limits.step_max_us),
    ):
        if most is not None and found is not None and found > most:
            yield f"{_whose(limits)}{what}: {microseconds(found)}, limit {microseconds(most)}"


def _counted(figures: Figures, of: Activations, limits: Limits) -> Iterator[str]:
    dropped = of.skipped + of.coalesced
    for what, found, most in (
        ("activations skipped or coalesced", dropped, limits.skips),
        ("overruns", of.overruns, limits.overruns),
        ("deadlines missed", sum(figures.deadline_misses.values()), limits.misses),
    ):
        if most is not None and found > most:
            yield f"{_whose(limits)}{what}: {found}, limit {most}"


def _unmeasured(figures: Figures, of: Figures | ModelFigures, limits: Limits) -> Iterator[str]:
    if figures.is_virtual:
        yield "the run was in virtual time, in which nothing is late and nothing takes time"
    elif of.run == 0:
        yield f"{_whose(limits)}nothing ran"
    elif of.run < SAMPLES_OF_P99 and (limits.p99_us, limits.step_p99_us) != (None, None):
        yield f"{_whose(limits)}{of.run} activations; a p99 takes {SAMPLES_OF_P99} or more"


def _whose(limits: Limits) -> str:
    return "" if limits.model is None else f"{limits.model}: "


def _demand_sound(figures: Figures, limits: Limits) -> None:
    """Raise ConfigError where there is nothing to judge by."""
    stated = {name: getattr(limits, name) for name in Limits.__slots__ if name != "model"}
    given = {name: limit for name, limit in stated.items() if limit is not None}
    faults = [
        f"{name}: {limit!r}; expected 0 or more"
        for name, limit in given.items()
        if isinstance(limit, bool) or not isinstance(limit, int | float) or not limit >= 0
    ]
    if not given:
        faults.append(f"no limit; expected one of {', '.join(stated)}")
    known = list(figures.models)
    if limits.model is not None and limits.model not in known:
        hint = did_you_mean(limits.model, known)
        faults.append(f"model {limits.model}: expected one of {', '.join(known)}{hint}")
    if limits.model is not None and limits.misses is not None:
        faults.append("misses: deadlines are of two models; expected no model with it")
    if faults:
        raise ConfigError("assert_timing", faults)


def _causes(figures: Figures) -> list[str]:
    """Causes of late steps that are the machine's, where these made half of them or more."""
    found = figures.late_by_cause or {}
    of_machine = {cause: steps for cause, steps in found.items() if cause in _MACHINES}
    if not of_machine or 2 * sum(of_machine.values()) < sum(found.values()):
        return []
    named = ", ".join(f"{cause} {steps}" for cause, steps in of_machine.items())
    return [f"late steps by causes of the machine: {named}; of {sum(found.values())}"]


def _scheduling(conditions: Conditions) -> list[str]:
    """No real-time priority, and what else was refused; a run that gave it up had it."""
    if conditions.run.overloaded_s is not None:
        return []
    found = [f"{name} refused: {request.reason}" for name, request in conditions.refused.items()]
    if not found and conditions.text("scheduler") not in _REAL_TIME:
        found.append(f"no real-time priority: {conditions.text('scheduler') or 'not known'}")
    return found


def _machine(conditions: Conditions) -> list[str]:
    found = []
    if conditions.stated.get("virtualised"):
        found.append("a virtual machine, which its host may stop at any time")
    governor = conditions.text("governor")
    if governor not in {None, "performance"}:
        found.append(f"the processors' governor is {governor}")
    return found
