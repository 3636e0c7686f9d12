"""That a recording has not the instant that is asked for: why, what is damaged, what to do."""

from typing import Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.reader import Recording

_MOST_NAMED: Final = 3


def no_instant(recording: Recording, at: int) -> ConfigError:
    """Return the error of a recording that cannot be run again from an instant, ns."""
    segments = recording.segments()
    if not segments:
        why = recording.no_keyframe()
        said = f"no section of it can be a beginning{'' if why is None else f' ({why})'}"
        expected = "expected a keyframe, or the start of the run"
    else:
        spans = [(each.first_at / SECOND, each.last_at / SECOND) for each in segments]
        ends = spans[-1][1]
        said = f"it ends at {ends:g} s" if at / SECOND > ends else f"it has no {at / SECOND:g} s"
        whole = " or ".join(f"from {begin:g} to {end:g} s" for begin, end in spans)
        expected = f"expected an instant {whole}"
    return ConfigError.of_one(str(recording.path), f"{said}{damage(recording)}; {expected}")


def damage(recording: Recording) -> str:
    """A clause that names what is damaged and what can be done; empty for a whole recording."""
    faults = recording.faults()
    if not faults:
        return ""
    more = f"; {len(faults) - _MOST_NAMED} more" if len(faults) > _MOST_NAMED else ""
    named = "; ".join(faults[:_MOST_NAMED])
    return f", and it is damaged ({named}{more}: `recordings recover` saves what is whole)"
