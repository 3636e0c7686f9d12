"""Whether a run kept its time, in words."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from firmware_runtime.statistics.page.words import count, passed
from firmware_runtime.statistics.periods_kept import not_keeping, periods_not_kept
from firmware_runtime.statistics.refusals import refused


class Verdict(NamedTuple):
    """`css` is `good`, `doubtful`, `bad` or `open`; `word` says the same without a colour."""

    css: str
    word: str
    sentences: list[str]


def verdict(statistics: Mapping[str, Any]) -> Verdict:
    """The verdict on the statistics of a run, given as `Statistics.as_json` gives them."""
    css, word = _worst_of(statistics)
    return Verdict(css, word, [*_ending(statistics), *_timing(statistics), *_beside(statistics)])


def _worst_of(statistics: Mapping[str, Any]) -> tuple[str, str]:
    state = statistics["conditions"]["run"]["state"]
    words = {"failed": "Failed", "overrun": "Stopped for lateness", "died": "Died"}
    if state in words:
        return "bad", words[state]
    doubts = {
        "Skipped activations": statistics["skipped"] > 0,
        "Late activations": statistics["overruns"] > 0,
        "Missed deadlines": any(statistics["deadline_misses"].values()),
        "Faults": bool(statistics["faults"]),
        "Period not kept": bool(not_keeping(statistics)),
    }
    for word, applies in doubts.items():
        if applies:
            return "doubtful", word
    if statistics["scheduled"] == 0:
        return "open", "Nothing to be late"
    return "good", "On time"


def _ending(statistics: Mapping[str, Any]) -> Iterator[str]:
    run = statistics["conditions"]["run"]
    after = passed(round(run["elapsed_s"] * 1e9))
    if run["state"] == "running":
        yield f"The run was under way for {after} when this page was made."
    elif run["state"] == "died":
        yield f"The process was gone after {after} without having ended the run."
    else:
        because = f": {run['reason']}" if run["reason"] else ""
        yield f"The run {_ENDED[run['state']]} after {after}{because}."
    if statistics["conditions"].get("clock") == "VirtualClock":
        yield "It ran in virtual time, in which nothing is ever late."
    if not run["complete"]:
        yield "It died while it wrote: the last step's numbers may be there in part."


_ENDED = {
    "ended": "ended",
    "stopped": "was stopped",
    "failed": "failed",
    "overrun": "was stopped by its policy",
}


def _timing(statistics: Mapping[str, Any]) -> Iterator[str]:
    scheduled, late, skipped = (statistics[key] for key in ("scheduled", "overruns", "skipped"))
    activations = count(scheduled, "activation")
    if scheduled == 0:
        yield "No model has been activated, so nothing could be late."
    elif late == skipped == 0:
        yield f"{activations}: none began later than its model tolerates, none was skipped."
    else:
        on_time = (statistics["run"] - late) * 10_000 // scheduled / 100  # 100 only if all were
        episodes = count(statistics["episodes"], "episode")
        lost = f"{late:,} late, {skipped:,} skipped, in {episodes}"
        yield f"{on_time:.2f} % of {activations} ran on time: {lost}."


def _beside(statistics: Mapping[str, Any]) -> Iterator[str]:
    yield from (f"{sentence}." for sentence in periods_not_kept(statistics))
    for path, kinds in statistics["faults"].items():
        reported = sum(counted["count"] for counted in kinds.values())
        yield f"{path} reported {count(reported, 'fault')}."
    missed = sum(statistics["deadline_misses"].values())
    if missed > 0:
        yield f"{count(missed, 'sample')} took effect too late, or never."
    errors = sum(bus["errors"] for bus in statistics["bus"].values())
    if errors > 0:
        yield f"{count(errors, 'bus transaction')} failed."
    dropped = statistics["conditions"]["run"]["inputs_dropped"]
    if dropped > 0:
        yield f"{count(dropped, 'input')} came too fast and found no room."
    overloaded_s = statistics["conditions"]["run"]["overloaded_s"]
    if overloaded_s is not None:
        yield f"After {overloaded_s:.1f} s the loop had no time left."
    settings = len(refused(statistics["conditions"]))
    if settings > 0:
        things = count(settings, "setting")
        yield f"{things} that the board asks of the system {_was(settings)} not granted."


def _was(number: int) -> str:
    return "was" if number == 1 else "were"
