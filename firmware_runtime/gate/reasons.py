"""What makes timing on this machine no robot's: sentences, from what can be seen."""

from collections.abc import Mapping

from firmware_runtime.host.doctor import processor
from firmware_runtime.host.doctor.machine import Machine
from firmware_runtime.statistics.blame import Cause
from firmware_runtime.statistics.conditions import Conditions
from firmware_runtime.statistics.figures import Figures

BUSY_SHARE = 0.1
"""Of all processors: other processes that take more disturb a measurement."""
STOLEN_SHARE = 0.01
"""Of all processors: a host that withholds more does."""
_OF_THE_MACHINE = ("governor", "undervoltage-throttling", "virtual-machine")
_MACHINES = (
    *(Cause.STOPPED, Cause.MOVED, Cause.THROTTLED, Cause.INTERRUPTS),
    *(Cause.STOLEN, Cause.PREEMPTED, Cause.SUPPLY, Cause.CLOCK),
)
"""What makes a step late and is neither the model's doing nor the board's."""
_REAL_TIME = ("SCHED_FIFO", "SCHED_RR")


def reasons_here(neighbours: Mapping[str, float]) -> list[str]:
    """What disturbs a measurement of processor time here, or did while these shares were taken."""
    machine = Machine()
    found = [
        f"{check.id}: {finding.seen}"
        for check in processor.CHECKS
        if check.id in _OF_THE_MACHINE
        and (finding := check.examine(machine)).status.needs_attention
    ]
    return [*busy(neighbours), *found]


def busy(neighbours: Mapping[str, float]) -> list[str]:
    """Others that took processor time meanwhile, by the shares that `Neighbours` gives."""
    found = []
    if (share := neighbours["processes"]) > BUSY_SHARE:
        found.append(f"other processes took {share:.0%} of the processors")
    if (share := neighbours["host"]) > STOLEN_SHARE:
        found.append(f"the host withheld {share:.0%} of the processors")
    return found


def reasons_of(figures: Figures) -> list[str]:
    """Why this run may have been late through no fault of its own."""
    conditions = figures.conditions
    return [*_causes(figures), *_scheduling(conditions), *_machine(conditions)]


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
