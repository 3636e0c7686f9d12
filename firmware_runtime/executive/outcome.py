"""How a run ended."""

from dataclasses import dataclass

from firmware_runtime.statistics.statistics import RunState


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of a run, after its outputs were made safe.

    `state` is ENDED (at the instant asked for, or nothing was due any more), STOPPED (on request),
    OVERRUN (by a policy) or FAILED (something was raised, or a device was never ready); `reason`
    says in a sentence what happened; `error` is what was raised, if something was. `faults` are
    sentences on what could not be made safe or exited.
    """

    state: RunState
    reason: str
    error: BaseException | None = None
    faults: tuple[str, ...] = ()
