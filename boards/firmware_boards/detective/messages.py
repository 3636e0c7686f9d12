"""Values of ports that carry two kinds, between the controllers and their sensors."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Message:
    """A number on a port that carries signals and angles; plain `Message` is the signal.

    Kinds never compare equal: a target of 1 degree, `Degree(1)`, is not the signal `Message(1)`.
    """

    value: float


@dataclass(frozen=True, slots=True)
class Degree(Message):
    """An angle in degrees from north, clockwise."""
