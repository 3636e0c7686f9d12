"""Statistics as a person reads them: one line, how it went, a table, the worst, the conditions."""

from collections.abc import Iterator, Sequence

from firmware_runtime.statistics.blame import sentence
from firmware_runtime.statistics.figures import (
    Causes,
    Figures,
    LinkFigures,
    ModelFigures,
    WorstActivation,
)
from firmware_runtime.statistics.file_header import Conditions, RunFigures
from firmware_runtime.statistics.histogram import Distribution
from firmware_runtime.statistics.number_formats import (
    Dates,
    instant,
    local,
    microseconds,
    percent,
    rate,
    seconds,
)
from firmware_runtime.statistics.rows import DeadlineRow
from firmware_runtime.statistics.summary import fault_lines, periods_not_kept, refusals, summary

_WORST_SHOWN = 3
_MARGIN = "  "


def statistics_text(figures: Figures, worst: int = _WORST_SHOWN) -> list[str]:
    """Lines for the statistics of one run."""
    return [
        summary(figures),
        _story(figures),
        *(f"  {sentence}" for sentence in periods_not_kept(figures)),
        *_virtual(figures),
        "",
        *_models(figures),
        *_times(figures),
        *_buses(figures),
        *_serial(figures),
        *_deadlines(figures),
        *_link(figures.link),
        *(f"  fault: {line}" for line in fault_lines(figures)),
        *_late_by_cause(figures),
        *_worst(figures, worst),
        "",
        *_conditions(figures.conditions),
    ]


def causes_text(causes: Causes) -> str:
    """Return what an activation spent most of its time on, four at most.

    The wire is within models.
    """
    spent = {
        "waking": causes.wake_us,
        "steps before": causes.behind_us,
        "garbage": causes.garbage_us,
        **causes.models_us,
        **{
            f"on the wire {bus} {address}": us
            for bus, devices in causes.bus_us.items()
            for address, us in devices.items()
        },
    }
    longest = sorted(spent.items(), key=lambda each: -each[1])[:4]
    text = ", ".join(f"{name} {microseconds(us)}" for name, us in longest if us > 0)
    return text or "nothing measurable"


def _story(figures: Figures) -> str:
    """Return how far it has come, or how it ended, in whole numbers."""
    run = figures.conditions.run
    state = "has run for" if run.state == "running" else f"{_ended(run)} after"
    return (
        f"{state} {seconds(run.elapsed_s)}: {figures.run} of "
        f"{figures.scheduled} activations run, {figures.skipped} skipped, "
        f"{figures.coalesced} coalesced{_waiting(figures)}{_reactions(figures)}{_overruns(figures)}"
    )


def _reactions(figures: Figures) -> str:
    """Return how often models answered an input at once, which is no activation of their own."""
    reactions = sum(model.reactions for model in figures.models.values())
    return f"; {_counted(reactions, 'reaction')} to inputs" if reactions else ""


def _overruns(figures: Figures) -> str:
    """Return how often it was late, where something can be."""
    if figures.is_virtual:
        return ""
    overruns = _counted(figures.overruns, "overrun")
    return f"; {overruns} in {_counted(figures.episodes, 'episode')}"


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _waiting(figures: Figures) -> str:
    """Return what is due and has not had its turn yet, where there is such a thing."""
    return f", {figures.waiting} waiting" if figures.waiting > 0 else ""


def _virtual(figures: Figures) -> list[str]:
    if not figures.is_virtual:
        return []
    return [
        "  in virtual time, in which nothing is late and nothing takes time: there are counts only"
    ]


def _ended(run: RunFigures) -> str:
    """Return how the run ended, with the reason unless that is only that its time was up."""
    if run.reason is None or run.state == "ended":
        return run.state
    return f"{run.state} ({run.reason})"


def _models(figures: Figures) -> list[str]:
    if not figures.models:
        return []
    if figures.is_virtual:
        head: tuple[str, ...] = ("activations of", "rate", "run", "reactions", "skipped")
        rows: list[tuple[str, ...]] = [
            (path, rate(model.period_us), *_counts(model), str(model.skipped))
            for path, model in figures.models.items()
        ]
        return _table([head, *rows])
    head = ("lateness of", "rate", "run", "reactions", "p50", "p99", "max")
    head += ("budget", "load", "late", "skipped")
    rows = [(path, *_model(model)) for path, model in figures.models.items()]
    return [*_table([(*head, "last"), *rows]), ""]


def _model(model: ModelFigures) -> tuple[str, ...]:
    late, last = model.lateness_us, model.last_late_t_ns
    return (
        rate(model.period_us),
        *_counts(model),
        *map(microseconds, (late.p50, late.p99, late.max)),
        microseconds(model.tolerance_us),
        percent(model.load),
        str(model.overruns),
        str(model.skipped),
        "-" if last is None else f"at {seconds(last / 1e9)}",
    )


def _counts(model: ModelFigures) -> tuple[str, str]:
    """Activations that were run, and answers to inputs; a dash for what such a model has not."""
    is_reactive = model.reactions > 0 and model.run == 0
    return "-" if is_reactive else str(model.run), str(model.reactions) if model.reactions else "-"


def _times(figures: Figures) -> list[str]:
    if figures.is_virtual:
        return []
    rows: list[tuple[str, ...]] = [("time of", "p50", "p90", "p99", "p99.9", "max")]
    for path, model in figures.models.items():
        rows.append((path, *_percentiles(model.step_us)))
    rows.append(("whole step", *_percentiles(figures.step_us)))
    return _table(rows)


def _percentiles(time: Distribution) -> Iterator[str]:
    return map(microseconds, (time.p50, time.p90, time.p99, time.p999, time.max))


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    return [f"{_MARGIN}{line}" for line in aligned(rows)]


def _buses(figures: Figures) -> list[str]:
    return [
        f"  bus {name}: {bus.transactions} transactions, {bus.bytes} bytes, "
        f"{bus.errors} errors, {bus.retries} retries, {percent(bus.utilisation)} busy"
        for name, bus in figures.bus.items()
    ]


def _serial(figures: Figures) -> list[str]:
    return [
        f"  serial port {name}: {port.writes} writes, {port.bytes_written} bytes written, "
        f"{port.bytes_read} bytes read, {port.errors} errors, "
        f"{percent(port.writing)} of the time writing, {percent(port.reading)} reading"
        for name, port in (figures.serial or {}).items()
    ]


def _deadlines(figures: Figures) -> list[str]:
    return [
        f"  deadline {path}: {deadline_text(counted)}"
        for path, counted in figures.deadlines.items()
    ]


def deadline_text(counted: DeadlineRow) -> str:
    """Return what became of the samples on a path.

    Of one that is not enabled nothing was measured.
    """
    if counted.answers == 0:
        return f"not enabled, none of {counted.samples} samples has been answered"
    return f"{counted.misses} missed"


def _link(link: LinkFigures | None) -> list[str]:
    """Return how the link to the other part went, what went wrong first."""
    return [] if link is None else [f"  link: {link_text(link)}"]


def link_text(link: LinkFigures) -> str:
    """A link in one line."""
    trip = link.round_trip_us
    refused = [f"{reason} {count}" for reason, count in link.refused.items() if count > 0]
    parts = [
        "good" if link.is_good else "not good",
        *([f"{_counted(link.silences, 'silence')}"] if link.silences > 0 else []),
        *([f"refused {', '.join(refused)}"] if refused else []),
        *([f"dropped {link.dropped}"] if link.dropped > 0 else []),
        *([f"overtaken {link.overtaken}"] if link.overtaken > 0 else []),
        *([f"given up {link.given_up}"] if link.given_up > 0 else []),
        *([f"left while not connected {link.unconnected}"] if link.unconnected > 0 else []),
        f"sent {link.sent}",
        f"received {link.received}",
        f"age p50 {microseconds(link.age_us.p50)} p99 {microseconds(link.age_us.p99)}",
        f"round trip p50 {microseconds(trip.p50)} p99 {microseconds(trip.p99)}",
    ]
    return "; ".join(parts)


def _worst(figures: Figures, shown: int) -> list[str]:
    is_in_real_time = figures.conditions.stated.get("clock") == "MonotonicClock"
    dates = Dates(figures.conditions.run.began_ns if is_in_real_time else None, (), 1.0)
    return [
        f"  worst: {worst.model} at {instant(worst.t_ns)}{dates.said(worst.t_ns)}, "
        f"{microseconds(worst.lateness_us)} late, step {microseconds(worst.step_us)}: "
        f"{causes_text(worst.causes)}{because(worst)}"
        for worst in figures.worst[:shown]
    ]


def because(worst: WorstActivation) -> str:
    """Return why it was late, where that was looked for."""
    return "" if worst.blame is None else f"; because: {sentence(worst.blame)}"


def _late_by_cause(figures: Figures) -> list[str]:
    """Return how often each cause made a step late, the most frequent first."""
    counted = sorted((figures.late_by_cause or {}).items(), key=lambda each: -each[1])
    named = ", ".join(f"{cause} {steps}" for cause, steps in counted)
    return [f"  late steps by cause: {named}"] if named else []


def _conditions(conditions: Conditions) -> list[str]:
    where = map(conditions.text, ("machine", "kernel", "python"))
    scheduler, priority = map(conditions.stated.get, ("scheduler", "scheduler_priority"))
    lines = [f"  on {', '.join(map(str, where))}, {scheduler} {priority or ''}".rstrip()]
    began = conditions.run.began_ns
    if began is not None:
        lines.append(f"  began {local(began)}")
    overloaded_s = conditions.run.overloaded_s
    if overloaded_s is not None:
        lines.append(f"  overloaded: after {overloaded_s:.1f} s the loop had no time left")
    return lines + [f"  {refusal}" for refusal in refusals(conditions.settings)]


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """The lines of a table: the first column to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            [row[0].ljust(widths[0])]
            + [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        ).rstrip()
        for row in rows
    ]
