"""How both ends of a stage fare, on one line while they run, and how it went, for people."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.number_formats import NOT_KNOWN, microseconds, milliseconds
from firmware_runtime.statistics.summary import outputs_text

ROLES: Final = ("controller", "robot")


def stage_line(reports: Mapping[str, Mapping[str, Any]], for_s: float) -> str:
    """Time, the shown value, arming, the link and what went wrong, of the controller and robot."""
    controller, robot = (reports.get(role, {}) for role in ROLES)
    if not (controller or robot):
        return "starting"
    at_s = controller.get("now_ns", 0) / SECOND
    words = [f"{at_s:.1f} of {for_s:g} s"]
    shown = robot if robot.get("value") is not None else controller
    if shown.get("value") is not None:
        words.append(f"{shown['shown'].rpartition('.')[2]} {shown['value']:.4g}")
    if robot:
        words.append("armed" if robot.get("armed") else "disarmed")
    link = _link(controller.get("link") or robot.get("link"))
    for name, word in (("overruns", "late"), ("faults", "faults")):
        counts = "+".join(str(each[name]) for each in (controller, robot) if name in each)
        words.append(f"{word} {counts}")
    return "  ".join([*words, link])


def _link(link: Mapping[str, Any] | None) -> str:
    if link is None:
        return "link not up"
    if link.get("why_bad") is not None:
        return f"link: {link['why_bad']}"
    return f"link good, age {milliseconds(link.get('age_us'))}"


def stage_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield the result, the link each way, and how either end fared."""
    ended, link = document["ended"], document["link"]
    if ended["state"] in {"failed", "overrun"}:
        yield f"failed: {ended['by'] or 'the stage'}: {ended['reason']}"
    yield ""
    for name, value in (document["result"] or {}).items():
        yield f"{name} {value:.4f}" if isinstance(value, float) else f"{name} {value}"
    if "outputs_on" in document:
        yield outputs_text(document["outputs_on"])
    yield ""
    impaired = link["impairment"]
    how = f", {impaired['how']} by {impaired['by']}" if impaired is not None else ""
    yield f"link: {link['over']}, between {link['between']}{how}"
    yield from (_way_text(way, link[way]) for way in ("out", "back") if link[way])
    for role in ROLES:
        yield from end_text(role, document[role], ended["by"])


def _way_text(way: str, crossed: Mapping[str, Any]) -> str:
    """What went one way; what only the other end knows, and left no word of, is a dash."""
    refused = crossed.get("refused", {})
    reasons = ", ".join(f"{count} {reason}" for reason, count in refused.items() if count)
    age = crossed.get("age_us", {})
    names = ("sent", "received", "dropped", "overtaken")
    counts = [f"{name} {crossed.get(name, NOT_KNOWN)}" for name in names]
    if given_up := crossed.get("given_up"):
        counts.append(f"given up {given_up}")
    if unconnected := crossed.get("unconnected"):
        counts.append(f"left while not connected {unconnected}")
    return (
        f"  {way}: {', '.join(counts)}, refused {reasons or '0'}; "
        f"age p50 {microseconds(age.get('p50'))}, p99 {microseconds(age.get('p99'))}"
    )


def end_text(role: str, end: Mapping[str, Any] | None, by: str | None) -> Iterator[str]:
    """How an end ended, and what became of its activations; `by` is the end that ended first."""
    if end is None or "statistics" not in end:
        yield f"{role}: no statistics here"
        return
    statistics = end["statistics"]
    late = statistics["lateness_us"]
    is_asked = by not in {None, role} and end["ended"]["reason"] == "SIGTERM"
    reason = f"stopped, for the {by} had ended" if is_asked else end["ended"]["reason"]
    yield (
        f"{role}: {reason}; {statistics['run']} of {statistics['scheduled']} "
        f"activations run, {statistics['skipped']} skipped, {statistics['coalesced']} coalesced, "
        f"{statistics['overruns']} late; "
        f"lateness p50 {microseconds(late['p50'])}, p99 {microseconds(late['p99'])}"
    )
