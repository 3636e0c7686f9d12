"""The worst activations, each as a bar of what it spent its time on, with the numbers below it.

A bar is the time from the activation's deadline to the end of its step. Steps before, waking, the
models' own times and the rest follow one another and add up to it. Garbage collection and time on
the wire lie somewhere within that time, so they are a second, thinner bar on the same scale.
"""

from collections import UserDict
from collections.abc import Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element

from firmware_runtime.statistics.blame import sentence
from firmware_runtime.statistics.figures import WorstActivation
from firmware_runtime.statistics.number_formats import NOTHING, duration_us, instant
from firmware_runtime.view.markup import element, legend
from firmware_runtime.view.plot import Plot

_COLOURS = 8
_LANES = ((0, 20), (24, 32))
"""Upper and lower edges of the two bars of an activation, in pixels."""
_HEIGHT = 34


class Cause(NamedTuple):
    """A part of the time, with its colour's class."""

    name: str
    us: float
    css: str


class Colours(UserDict[str, str]):
    """A colour for each name, by the order in which names are first met."""

    def __missing__(self, name: str) -> str:
        self[name] = f"colour{len(self) % _COLOURS}"
        return self[name]


_ABOUT = (
    "Each bar is the time from the activation's deadline to the end of its step. Collections of "
    "garbage and time on the wire lie somewhere within it: the thin bar below shows how long they "
    "took, on the same scale."
)


def worst_activations(worst: Sequence[WorstActivation]) -> list[Element]:
    """A list of them, the worst first."""
    if not worst:
        return [
            element(
                "p", "No activation has been kept: what only answers inputs has none of its own."
            )
        ]
    colours = Colours()
    bars = (_activation(number, each, colours) for number, each in enumerate(worst))
    return [element("p", _ABOUT), element("ol", *bars, class_="worst-list")]


def in_row(activation: WorstActivation, colours: Colours) -> list[Cause]:
    """Return what followed one another from the deadline to the end of the step."""
    causes = activation.causes
    models = causes.models_us
    rest = activation.step_us - sum(models.values())
    return _spent(
        Cause("steps before", causes.behind_us, "behind"),
        Cause("waking", causes.wake_us, "waking"),
        *(Cause(path, us, colours[path]) for path, us in models.items()),
        Cause("kernel and accounting", rest, "rest"),
    )


def within(activation: WorstActivation) -> list[Cause]:
    """Return what took place somewhere in that time."""
    causes = activation.causes
    devices = (
        Cause(f"{bus} {address}", us, f"wire{number % 2}")
        for bus, addresses in causes.bus_us.items()
        for number, (address, us) in enumerate(addresses.items())
    )
    return _spent(Cause("garbage", causes.garbage_us, "garbage"), *devices)


def _spent(*causes: Cause) -> list[Cause]:
    """Without what took no time, or only the error of a sum of decimal fractions."""
    return [cause for cause in causes if cause.us >= 0.001]


def _activation(number: int, activation: WorstActivation, colours: Colours) -> Element:
    lanes = in_row(activation, colours), within(activation)
    whole = max(activation.lateness_us + activation.step_us, *map(_sum, lanes), 0.001)
    plot = Plot(_HEIGHT)
    for lane, place in zip(lanes, _LANES, strict=True):
        _draw(plot, lane, place, whole)
    title = f"{activation.model or NOTHING} at {instant(activation.t_ns)}"
    said = ", ".join(words for lane in lanes for _, words in _said(lane))
    late, step = duration_us(activation.lateness_us), duration_us(activation.step_us)
    blame = activation.blame
    return element(
        "li",
        element("h3", title, element("span", f" {late} late, step {step}", class_="quiet")),
        plot.svg(f"worst-{number}", title, said),
        legend(_said(lanes[0])),
        legend(_said(lanes[1]), "within it: ") if lanes[1] else None,
        None if blame is None else element("p", f"because: {sentence(blame)}", class_="quiet"),
    )


def _sum(causes: Sequence[Cause]) -> float:
    return sum(cause.us for cause in causes)


def _said(causes: Sequence[Cause]) -> list[tuple[str, str]]:
    return [(cause.css, f"{cause.name} {duration_us(cause.us)}") for cause in causes]


def _draw(plot: Plot, causes: Sequence[Cause], down: tuple[int, int], whole: float) -> None:
    """One bar of segments, from its left end."""
    left = 0.0
    for cause, (css, words) in zip(causes, _said(causes), strict=True):
        right = left + cause.us / whole
        plot.box((left, right), down, f"segment {css}", words)
        left = right
