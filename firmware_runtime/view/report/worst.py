"""The worst activations, each as a bar of what it spent its time on.

A bar is the time from the activation's deadline to the end of its step. Steps before, waking, the
models' own times and the rest follow one another and add up to it. Garbage collection and time on
the wire lie somewhere within that time, so they are a second, thinner bar on the same scale.
"""

from collections import UserDict
from collections.abc import Sequence

from firmware_runtime.statistics.blame import sentence
from firmware_runtime.statistics.figures import WorstActivation
from firmware_runtime.statistics.number_formats import NOTHING, duration_us, instant
from firmware_runtime.view.parts import Bar, Bars, Part, Piece, Text

_COLOURS = 8


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


def worst_activations(worst: Sequence[WorstActivation]) -> list[Part]:
    """A bar for each, the worst first."""
    if not worst:
        none = "No activation has been kept: what only answers inputs has none of its own."
        return [Text(text=none)]
    colours = Colours()
    return [Text(text=_ABOUT), Bars(rows=[_activation(each, colours) for each in worst])]


def in_row(activation: WorstActivation, colours: Colours) -> list[Piece]:
    """Return what followed one another from the deadline to the end of the step."""
    causes = activation.causes
    models = causes.models_us
    rest = activation.step_us - sum(models.values())
    return _spent(
        ("steps before", causes.behind_us, "behind"),
        ("waking", causes.wake_us, "waking"),
        *((path, us, colours[path]) for path, us in models.items()),
        ("kernel and accounting", rest, "rest"),
    )


def within(activation: WorstActivation) -> list[Piece]:
    """Return what took place somewhere in that time."""
    causes = activation.causes
    devices = (
        (f"{bus} {address}", us, f"wire{number % 2}")
        for bus, addresses in causes.bus_us.items()
        for number, (address, us) in enumerate(addresses.items())
    )
    return _spent(("garbage", causes.garbage_us, "garbage"), *devices)


def _spent(*causes: tuple[str, float, str]) -> list[Piece]:
    """Without what took no time, or only the error of a sum of decimal fractions."""
    return [Piece(name, us, duration_us(us), colour) for name, us, colour in causes if us >= 0.001]


def _activation(activation: WorstActivation, colours: Colours) -> Bar:
    late, step = duration_us(activation.lateness_us), duration_us(activation.step_us)
    blame = activation.blame
    return Bar(
        title=f"{activation.model or NOTHING} at {instant(activation.t_ns)}",
        lanes=[in_row(activation, colours), within(activation)],
        note=f"{late} late, step {step}",
        why="" if blame is None else sentence(blame),
        at=activation.t_ns,
    )
