"""A recorded state carried over to a robot that was built otherwise: other settings, other code.

Of three states, that of the keyframe, that in which the recorded robot was built, and that in which
this one was: what the run had changed by the keyframe is the keyframe's, and what it had not is as
this robot was built with.
"""

from collections.abc import Callable
from typing import Any

from firmware_runtime.blackbox.state.layouts import Thing

Same = Callable[[Thing, Thing], bool]


def carried(recorded: Thing, built: Thing, present: Thing, same: Same) -> Any:  # noqa: ANN401
    """The columns of the state to be in."""
    return [
        [_each(*each, same) for each in zip(*columns, strict=True)]
        for columns in zip(recorded, built, present, strict=True)
    ]


def _each(recorded: Thing, built: Thing, present: Thing, same: Same) -> Thing:
    """What one object holds, field by field where it has the same fields in all three."""
    if type(recorded) is type(built) is type(present):
        if isinstance(recorded, dict):
            keys = [key for key in recorded if key in built and key in present]
            return recorded | {
                key: _one(recorded[key], built[key], present[key], same) for key in keys
            }
        if isinstance(recorded, list | tuple) and len(recorded) == len(built) == len(present):
            parts = zip(recorded, built, present, strict=True)
            return type(recorded)([_one(*part, same) for part in parts])
    return _one(recorded, built, present, same)


def _one(recorded: Thing, built: Thing, present: Thing, same: Same) -> Thing:
    return present if same(recorded, built) else recorded
