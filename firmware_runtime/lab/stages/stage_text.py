"""How both ends of a stage fare, on one line while they run, and how it went, for people."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.closing_text import (
    closing_lines,
    did_text,
    next_text,
    outputs_text,
    punctuality,
    went_wrong,
)
from firmware_runtime.statistics.figures import Figures, figures_from
from firmware_runtime.statistics.number_formats import NOT_KNOWN, count, milliseconds

ROLES: Final = ("controller", "robot")
ResultText: TypeAlias = Callable[[Mapping[str, Any]], str]
"""What a board's robot did in a run with this result, in a sentence."""


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


def stage_lines(
    document: Mapping[str, Any], names: Mapping[str, str], result_text: ResultText | None
) -> list[str]:
    """Return the last lines of a stage; `names` are those by which its runs here are known.

    Raises ConfigError for what goes wrong in the board's own words.
    """
    figures = {role: _figures(document[role]) for role in ROLES}
    outputs_on = document.get("outputs_on")
    rest = [
        *([] if outputs_on is None else [outputs_text(outputs_on)]),
        *(f"{role}: {_punctuality(each)}" for role, each in figures.items()),
        _link_line(document["link"]),
        *_where_to_go_on(document, names),
    ]
    did = _did(document, figures["controller"], result_text)
    return closing_lines([*did], [*_went_wrong(document, figures)], rest)


def _figures(end: Mapping[str, Any] | None) -> Figures | None:
    """Figures of an end; None where it left none here."""
    return None if end is None or "statistics" not in end else figures_from(end["statistics"])


def _punctuality(figures: Figures | None) -> str:
    return "no statistics here" if figures is None else punctuality(figures)


def _did(
    document: Mapping[str, Any], figures: Figures | None, result_text: ResultText | None
) -> Iterator[str]:
    """What the robot did, by the board's words if it has some; and what stopped it, if so."""
    result, ended, board = document["result"] or {}, document["ended"], document["board"]
    if result and result_text is not None:
        yield result_text(result)
    elif figures is not None:
        yield did_text(board, figures, None, result)
    else:
        yield f"{board} did not run"
    if ended["state"] == "stopped":
        yield f"stopped: {ended['reason']}"


def _went_wrong(
    document: Mapping[str, Any], figures: Mapping[str, Figures | None]
) -> Iterator[str]:
    ended = document["ended"]
    if ended["state"] in {"failed", "overrun"}:
        yield f"failed: {ended['by'] or 'the stage'}: {ended['reason']}"
    for role, each in figures.items():
        if each is not None:
            yield from (f"{role}: {sentence}" for sentence in went_wrong(each))


def _link_line(link: Mapping[str, Any]) -> str:
    """What was between the ends, and how much of what each sent arrived."""
    impaired = link["impairment"]
    how = f", {impaired['how']} by {impaired['by']}" if impaired is not None else ""
    ways = (f"{way} {_way_text(link[way])}" for way in ("out", "back") if link[way])
    return f"link by {link['over']}, {link['between']}{how}: {', '.join(ways) or 'nothing crossed'}"


def _way_text(crossed: Mapping[str, Any]) -> str:
    """What went one way; what only the other end knows, and left no word of, is a dash."""
    sent, received = (_counted(crossed.get(name)) for name in ("sent", "received"))
    age_us = crossed.get("age_us", {}).get("p50")
    return f"{received} of {sent} values in {milliseconds(age_us)}"


def _counted(number: int | None) -> str:
    return NOT_KNOWN if number is None else count(number)


def _where_to_go_on(document: Mapping[str, Any], names: Mapping[str, str]) -> Iterator[str]:
    """Where the runs of the ends here are recorded, and the verbs that show more of them."""
    ends = {role: document[role] or {} for role in names}
    if recorded := [each["recording"] for each in ends.values() if "recording" in each]:
        yield f"recorded in {' and '.join(recorded)}"
    ran = [role for role, each in ends.items() if "statistics" in each]
    for role in ran[:1]:
        run = names[role]
        is_recorded = "recording" in ends[role]
        (line,) = next_text(run if is_recorded else None, run)
        others = "".join(f"; the {each} end is {names[each]}" for each in ran[1:])
        yield f"{line}{others}"
