"""Verdict on whether a run kept its time, in words."""

from collections.abc import Iterator

from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.number_formats import count, passed
from firmware_runtime.statistics.summary import periods_not_kept
from firmware_runtime.view.parts import Judgement, Verdict


def verdict(figures: Figures) -> Verdict:
    """The verdict on the statistics of a run."""
    judgement, word = _worst_of(figures)
    sentences = [*_ending(figures), *_timing(figures), *_beside(figures)]
    return Verdict(judgement=judgement, word=word, sentences=sentences)


def _worst_of(figures: Figures) -> tuple[Judgement, str]:
    state = figures.conditions.run.state
    words = {"failed": "Failed", "overrun": "Stopped for lateness", "died": "Died"}
    if state in words:
        return "bad", words[state]
    doubts = {
        "Skipped activations": figures.skipped > 0,
        "Late activations": figures.overruns > 0,
        "Missed deadlines": any(figures.deadline_misses.values()),
        "Faults": bool(figures.faults),
        "Period not kept": bool(figures.not_keeping_period),
    }
    for word, applies in doubts.items():
        if applies:
            return "doubtful", word
    if figures.scheduled == 0:
        return "open", "Nothing to be late"
    return "good", "On time"


def _ending(figures: Figures) -> Iterator[str]:
    run = figures.conditions.run
    after = passed(round(run.elapsed_s * 1e9))
    if run.state == "running":
        yield f"The run was under way for {after} when this page was made."
    elif run.state == "died":
        yield f"The process was gone after {after} without having ended the run."
    else:
        because = f": {run.reason}" if run.reason else ""
        yield f"The run {_ENDED[run.state]} after {after}{because}."
    if figures.is_virtual:
        yield "It ran in virtual time, in which nothing is ever late."
    if not run.complete:
        yield "It died while it wrote: the last step's numbers may be there in part."


_ENDED = {
    "ended": "ended",
    "stopped": "was stopped",
    "failed": "failed",
    "overrun": "was stopped by its policy",
}


def _timing(figures: Figures) -> Iterator[str]:
    scheduled, late, skipped = figures.scheduled, figures.overruns, figures.skipped
    activations = count(scheduled, "activation")
    if scheduled == 0:
        yield "No model has been activated, so nothing could be late."
    elif late == skipped == 0:
        yield f"{activations}: none began later than its model tolerates, none was skipped."
    else:
        on_time = (figures.run - late) * 10_000 // scheduled / 100  # 100 only if all were
        episodes = count(figures.episodes, "episode")
        lost = f"{late:,} late, {skipped:,} skipped, in {episodes}"
        yield f"{on_time:.2f} % of {activations} ran on time: {lost}."


def _beside(figures: Figures) -> Iterator[str]:
    yield from (f"{sentence}." for sentence in periods_not_kept(figures))
    for path, kinds in figures.faults.items():
        reported = sum(counted.count for counted in kinds.values())
        yield f"{path} reported {count(reported, 'fault')}."
    missed = sum(figures.deadline_misses.values())
    if missed > 0:
        yield f"{count(missed, 'sample')} took effect too late, or never."
    errors = sum(bus.errors for bus in figures.bus.values())
    if errors > 0:
        yield f"{count(errors, 'bus transaction')} failed."
    failed = sum(port.errors for port in (figures.serial or {}).values())
    if failed > 0:
        yield f"{count(failed, 'call')} of a serial port failed."
    dropped = figures.conditions.run.inputs_dropped
    if dropped > 0:
        yield f"{count(dropped, 'input')} came too fast and found no room."
    overloaded_s = figures.conditions.run.overloaded_s
    if overloaded_s is not None:
        yield f"After {overloaded_s:.1f} s the loop had no time left."
    settings = len(figures.conditions.refused)
    if settings > 0:
        were = "was" if settings == 1 else "were"
        things = count(settings, "setting")
        yield f"{things} that the board asks of the system {were} not granted."
