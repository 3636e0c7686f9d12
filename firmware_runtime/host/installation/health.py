"""Whether a robot that a service runs is healthy, and its timing no worse than a version's before.

    begins within WITHIN_S -> runs for the seconds asked -> has few faults in them: chips answer;
    each model with a period is due as often as it was, in the whole and in each part of that time;
    beside figures from before: each kind of fault comes no more often, no more activations are
    late, none for one cause more often, and steps are no longer

Timing is compared as far as half a minute can tell: what is worse by less than the allowances below
is not. Figures of another board, or of a computer that differs, are not compared.
"""

from collections.abc import Iterator
from itertools import pairwise
from time import monotonic, sleep
from typing import Final, NamedTuple

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.comparison import difference, same_run
from firmware_runtime.statistics.figures import Figures, ModelFigures
from firmware_runtime.statistics.paths import find_statistics
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

WITHIN_S: Final = 60.0
"""How long a service may take to its first activations."""
LOOK_S: Final = 1.0
PARTS: Final = 3
"""So many parts of a trial are looked at on their own: a model may stop in the middle of it."""
RARER: Final = 0.5
"""A model is due too rarely below this share of what it was, but for one activation;"""
MUCH_FASTER: Final = 1.1
"""where it was so much more often than its period now says, below this share of that."""
FAULT_SHARE: Final = 0.05
"""So much larger, by the model's activations, may be the share of a kind of fault: a busy computer
misses a sample now and then."""
LATE_SHARE: Final = 0.02
"""So much larger may be the share of activations that were late."""
LONGER: Final = 1.5
"""So many times longer may a step be at its median;"""
LONGER_US: Final = 200.0
"""where that is less, so much longer."""
CAUSE_SHARE: Final = 0.01
"""So much larger may be the share of steps that were late for one cause."""
OFTENER: Final = 2.0
"""So many times larger may both shares be: of a busy computer, where much was late before, they
differ by more from one half minute to the next."""
_ALIKE: Final = ("board", "machine", "model", "governor", "clock")


class Trial(NamedTuple):
    """The figures of a run for some seconds, and those of each part of that time."""

    whole: Figures
    parts: tuple[Figures, ...] = ()


def observed(board: str, seconds: float) -> Trial:
    """Return the figures of so many seconds of a run, once it has begun.

    Raises StatisticsFileError where it does not begin, or ends.
    """
    give_up_at = monotonic() + WITHIN_S
    while (first := _begun(board)) is None:
        if monotonic() > give_up_at:
            raise StatisticsFileError(
                f"no activation within {WITHIN_S:g} s", where=board, expected="a run under way"
            )
        sleep(LOOK_S)
    readings = [first]
    for _ in range(PARTS):
        sleep(seconds / PARTS)
        last = _begun(board)
        if last is None or not same_run(last, readings[-1]):
            how = "has ended" if last is None else "has begun again"
            raise StatisticsFileError(f"the run {how}", where=board, expected="it to go on")
        readings.append(last)
    parts = (difference(later, earlier).figures() for earlier, later in pairwise(readings))
    return Trial(difference(readings[-1], first).figures(), tuple(parts))


def _begun(board: str) -> Statistics | None:
    """Return the statistics of the run under way, once it has done a step."""
    try:
        found = read_statistics(find_statistics(board))
    except StatisticsFileError:
        return None
    return found if found.writer_alive and found.figures().has_begun else None


def complaints(trial: Trial, before: Figures | None) -> Iterator[str]:
    """Yield what is wrong with a run, and what is worse than before; nothing if it is healthy."""
    figures = trial.whole
    for path, model in figures.models.items():
        yield from _rarer(trial, path, before)
        for kind, fault in figures.faults.get(path, {}).items():
            if fault.count > (FAULT_SHARE + _share_of(before, path, kind)) * _activity(model):
                yield f"{path}: {fault.count} times {kind}; {fault.last}"
    if before is not None and not _differing(figures, before):
        yield from _slower(figures, before)


def _rarer(trial: Trial, path: str, before: Figures | None) -> Iterator[str]:
    """Yield a sentence if a model with a period was due too rarely, in the whole or in a part.

    What a slow or busy computer skips was due: it is judged by how late activations are.
    """
    declared = _declared_hz(trial.whole.models[path])
    if declared is None:
        return
    usual, whose = declared, "by its period"
    if before is not None and path in before.models:
        then = _due_hz(before, path)
        if then < MUCH_FASTER * declared:  # else its period was made longer
            usual, whose = then, "before"
    for each in (trial.whole, *trial.parts):
        expected = usual * each.conditions.run.elapsed_s
        if each.models[path].scheduled + 1 < RARER * expected:
            yield f"{path} was due {_due_hz(each, path):.3g} times a second, {usual:.3g} {whose}"
            return


def _due_hz(figures: Figures, path: str) -> float:
    seconds = figures.conditions.run.elapsed_s
    return figures.models[path].scheduled / seconds if seconds > 0 else 0.0


def _declared_hz(model: ModelFigures) -> float | None:
    """Return how often a model is due by its period; None for one without a period."""
    return 1e6 / model.period_us if model.kind == "periodic" and model.period_us else None


def _activity(model: ModelFigures) -> int:
    """Return how often a model did anything: by its own time, or answering an input at once."""
    return model.run + model.reactions


def _share_of(before: Figures | None, path: str, kind: str) -> float:
    """Return how often a kind of fault came before, by what the model did."""
    if before is None or kind not in before.faults.get(path, {}):
        return 0.0
    return before.faults[path][kind].count / max(_activity(before.models[path]), 1)


def not_compared(figures: Figures, before: Figures) -> str | None:
    """Return why timing was not compared, if it was not."""
    differing = _differing(figures, before)
    return f"{', '.join(differing)} differ from before" if differing else None


def _differing(figures: Figures, before: Figures) -> list[str]:
    now, then = figures.conditions, before.conditions
    return [name for name in _ALIKE if now.text(name) != then.text(name)]


def _slower(figures: Figures, before: Figures) -> Iterator[str]:
    now, then = _late_share(figures), _late_share(before)
    if now > max(then + LATE_SHARE, then * OFTENER):
        yield f"{now:.1%} of its activations are late, {then:.1%} were before"
    step, usual = figures.step_us.p50, before.step_us.p50
    if step is not None and usual is not None and step > max(usual * LONGER, usual + LONGER_US):
        yield f"a step takes {step:.0f} us at its median, {usual:.0f} us before"
    steps = max(figures.conditions.run.steps, 1)
    steps_before = max(before.conditions.run.steps, 1)
    for cause, count in (figures.late_by_cause or {}).items():
        usual_count = (before.late_by_cause or {}).get(cause, 0)
        usual_share = usual_count / steps_before
        if count / steps > max(usual_share + CAUSE_SHARE, usual_share * OFTENER):
            share = f"{count} of {steps} steps"
            yield f"{share} were late by {cause}, {usual_count} of {steps_before} before"


def _late_share(figures: Figures) -> float:
    return figures.overruns / figures.run if figures.run else 0.0
