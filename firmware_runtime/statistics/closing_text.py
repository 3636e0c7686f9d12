"""The last lines of a run, for people: what it did, what went wrong, outputs, punctuality, more.

Twelve at most. Everything else, with the table of each model, is in `stats`.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from firmware_runtime.statistics.blame import ABOUT, Blame
from firmware_runtime.statistics.figures import Figures, LinkFigures, WorstActivation
from firmware_runtime.statistics.file_header import Settings
from firmware_runtime.statistics.number_formats import count, milliseconds, seconds
from firmware_runtime.statistics.summary import fault_lines, periods_not_kept

VIRTUAL: Final = "in virtual time: no activation can be late"
MOST: Final = 12
"""Lines at the end of a run."""


def closing_lines(did: Sequence[str], wrong: Sequence[str], rest: Sequence[str]) -> list[str]:
    """All lines in their order; of what went wrong, the first that there is room for."""
    room = MOST - len(did) - len(rest)
    if len(wrong) > room:
        wrong = [*wrong[: room - 1], f"and {count(len(wrong) - room + 1, 'more thing')} went wrong"]
    return [*did, *wrong, *rest]


def did_text(name: str, figures: Figures, ending: str | None, known: Mapping[str, Any]) -> str:
    """Return what a robot did that has no words of its own for it: how long it ran, what it knows.

    `ending` is the model's own word on the end of its task, if it had one.
    """
    knows = ", ".join(f"{key} {_value(value)}" for key, value in known.items())
    words = [each for each in (ending, knows) if each]
    ran = f"{name} ran for {seconds(figures.conditions.run.elapsed_s)}"
    return f"{ran}: {'; '.join(words)}" if words else ran


def stopped_text(figures: Figures, reason: str) -> str:
    """Return when a run was stopped, and what for, such as a signal's name."""
    return f"stopped after {seconds(figures.conditions.run.elapsed_s)}: {reason}"


def _value(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


# What went wrong ---------------------------------------------------------------------------------


def went_wrong(figures: Figures, *, drives_outside: bool = False) -> Iterator[str]:
    """A sentence on each thing that went wrong by the figures of a run, the gravest first.

    Settings that the system refused count where something was late, and where outputs are outside
    of the process that drives them.
    """
    yield from (f"fault: {line}" for line in fault_lines(figures))
    yield from (f"warning: {line}" for line in periods_not_kept(figures))
    for path, counted in figures.deadlines.items():
        if counted.misses > 0:
            yield f"deadline {path}: {counted.misses} missed"
    if figures.link is not None:
        yield from _link_faults(figures.link)
    overloaded_s = figures.conditions.run.overloaded_s
    if overloaded_s is not None:
        yield f"overloaded: after {seconds(overloaded_s)} the loop had no time left"
    is_late = figures.overruns + figures.skipped > 0
    if not figures.is_virtual and (is_late or drives_outside):
        yield from _refused(figures.conditions.refused)


def _link_faults(link: LinkFigures) -> Iterator[str]:
    refused = sum(link.refused.values())
    counts = {"silences": link.silences, "refused": refused, "given up": link.given_up}
    if any(counts.values()):
        yield f"link: {', '.join(f'{name} {number}' for name, number in counts.items() if number)}"


def _refused(refused: Settings) -> Iterator[str]:
    asked = [f"{name} = {each.asked} ({each.reason})" for name, each in refused.items()]
    if asked:
        yield f"not granted: {', '.join(asked)}; `firmware-runtime doctor` says what to do"


# Outputs, punctuality ----------------------------------------------------------------------------


def outputs_text(outputs_on: Mapping[str, int] | None, *, not_safe: bool = False) -> str:
    """Return which outputs are on after a run; None or nothing where that cannot be seen.

    `not_safe`: some could not be switched off.
    """
    on = ", ".join(f"{name} {number}" for name, number in (outputs_on or {}).items() if number)
    if on:
        return f"outputs still on: {on}"
    if not_safe:
        return "outputs may still be on: not all could be switched off"
    return "all outputs off" if outputs_on else "all outputs were switched off"


def punctuality(figures: Figures) -> str:
    """Return how many ticks were on time, and how late the worst one was, and why."""
    if figures.is_virtual:
        return VIRTUAL
    if figures.scheduled == 0:
        reactions = sum(model.reactions for model in figures.models.values())
        return f"no tick of its own; {count(reactions, 'reaction')} to inputs"
    on_time, latest = figures.run - figures.overruns, milliseconds(figures.lateness_us.max)
    if on_time == figures.scheduled:
        return f"all {count(on_time, 'tick')} on time, within {latest}"
    ticks = f"{count(on_time)} of {count(figures.scheduled, 'tick')} on time"
    if figures.overruns == 0:  # a tick that never ran has no lateness
        return f"{ticks}; {count(figures.scheduled - figures.run)} did not run"
    return f"{ticks}; the worst {latest} late{_why(figures.worst)}"


def _why(worst: Sequence[WorstActivation]) -> str:
    """Return why the latest was late, where that was looked for."""
    latest = max(worst, key=lambda each: each.lateness_us, default=None)
    if latest is None or latest.blame is None:
        return ""
    return f": {_cause(latest.blame)}"


def _cause(blame: Blame) -> str:
    who = "" if blame.culprit is None else f" ({blame.culprit})"
    return f"{ABOUT.get(blame.cause, blame.cause)}{who}"


def next_text(run: str | None, statistics: str | None) -> Iterator[str]:
    """Yield the verbs that show more: of a recorded run, and of statistics; None for neither."""
    of_run = [] if run is None else [f"view {run}", f"replay {run}"]
    table = [] if statistics is None else [f"stats {statistics} (the table)"]
    page = [] if statistics is None else [f"report {statistics} -o page.html"]
    if verbs := [*of_run[:1], *table, *page, *of_run[1:]]:
        yield f"next: firmware-runtime {', '.join(verbs)}"
