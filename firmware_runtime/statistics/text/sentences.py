"""What went wrong in a run, in sentences: faults, periods not kept, requests refused."""

from collections.abc import Iterator, Mapping

from firmware_runtime.statistics.conditions import Settings
from firmware_runtime.statistics.figures import FaultFigures, Figures
from firmware_runtime.statistics.number_formats import seconds


def fault_lines(figures: Figures) -> Iterator[str]:
    """A line for each kind of fault of each model."""
    for path, kinds in figures.faults.items():
        for kind, counted in kinds.items():
            yield f"{path} {kind} {_times(counted.count)}{_when(counted)}: {counted.last}"


def periods_not_kept(figures: Figures) -> Iterator[str]:
    """A sentence on each model that does not come back at the period that it states."""
    for path in figures.not_keeping_period:
        model = figures.models[path]
        yield (
            f"{path} states a period of {(model.period_us or 0) / 1000:g} ms and does not keep it: "
            f"{model.irregular} of {model.run} activations came at another time, the last "
            f"{(model.returned_after_us or 0) / 1000:g} ms after the one before"
        )


def refusals(settings: Settings) -> Iterator[str]:
    """A line for each request that was refused."""
    for name, request in settings.items():
        if request.is_refused:
            yield f"not granted: {name} = {request.asked} ({request.reason})"


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _when(counted: FaultFigures) -> str:
    """When the first and the last came, as far as that is known."""
    first, last = counted.first_s, counted.last_s
    if last is None:
        return ""
    if counted.count == 1:
        return f" at {seconds(last)}"
    begun = "" if first is None else f" from {seconds(first)}"
    return f"{begun} to {seconds(last)}"


def outputs_text(outputs_on: Mapping[str, int]) -> str:
    """How many outputs of each chip are on after a run; "none is known" where no chip can say."""
    if not outputs_on:
        return "outputs still on: none is known"
    on = ", ".join(f"{name} {count}" for name, count in outputs_on.items() if count)
    return f"outputs still on: {on or 'none'}"
