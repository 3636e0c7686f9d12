"""How `name@Class` in a model file becomes an atomic model."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from firmware_runtime.devs.atomic import Atomic


@dataclass(frozen=True, slots=True)
class AtomicClass:
    """A constructor, and which of its keyword arguments a model file may set by which key."""

    build: Callable[..., Atomic]
    """Called with the model's name and the arguments the file sets."""
    times: Mapping[str, str] = field(default_factory=dict)
    """Keys with a value `HH:MM:SS:ms`, which arrives in ns."""
    numbers: Mapping[str, str] = field(default_factory=dict)
    """Keys with a whole number or a decimal, which arrives as float."""
