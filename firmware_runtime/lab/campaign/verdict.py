"""Verdicts: which oracle found something wrong with a struck robot, or that nothing is.

| oracle | what is wrong |
|---|---|
| `crash` | something was raised that is no fault of the world, or the process died |
| `hang` | a second of the robot takes no end of processor time |
| `on` | an output is on: the run is over and its lines work, or it is lost, or was disarmed, |
| | or what it needs, as the rig says, fails, or has reported a fault |
| `held` | outputs have been on and as they are for too long, where the rig says how long is |
| `stale` | a device fails at each use, and its model sends values all the same |
| `late` | a device fails at each use, outputs are driven, and nothing was reported in time, |
| | or what was reported is about something else |
| `mute` | a device fails, or its supply has, and it is off for a second where healthy ones |
| | are on, and nothing was reported |
| `withheld` | a device's values no longer come, the robot is driven on, and nothing was reported |
| `slowed` | the robot is driven, and uses a device half as often that is not at fault |
| `silent` | the robot left the envelope of its healthy runs, is driven, and nothing was reported |
| `not-finite` | a port has sent a number that is none |
| `astray` | long after a fault, or its report, the robot is driven where no healthy one was |
| `unhealed` | long after a fault outputs are off, or it is still reported; or a run has ended of |
| | one that was over at once, where the rig says that it heals |
| `invented` | a fault is reported in a mission without any, or where it was only disarmed |
| `changed` | its settings were taken up again as they are, and it goes on otherwise |
| `idle` | a mission without any fault never has an output on |
| `missed` | a mission without any fault does not come to what it is for, as the rig knows; |
| | or one whose fault was over long ago does not, or does not end |
| `misused` | in a mission without any fault a chip is used as its data sheet does not allow |
| `paced` | in a mission without any fault a bus is used more or less often than its board says |
| `account` | activations that were scheduled and those that are accounted for differ |
| `own` | what the board's own oracle says |
"""

from typing import Final

from msgspec import Struct

from firmware_runtime.errors import raised_at

SOUND: Final = "sound"
OF_TRUTH: Final = ("silent", "astray")
"""Those that go by the numbers of its world's truth."""


class Verdict(Struct, frozen=True, kw_only=True):
    """What became of a struck robot."""

    outcome: str
    """`sound`, or the oracle that found something."""
    what: str = ""
    """A sentence about it."""
    model: str = ""
    at: int = 0
    """When it was known, ns of the run."""
    said: str | None = None
    """The first fault that was reported, `MODEL: KIND`."""
    said_after: int | None = None
    """Ns from the strike to that."""
    struck: bool = False
    """Whether the fault showed on a line."""
    ended: str | None = None
    """Why the run was over, if it was."""
    reached: tuple[str, ...] = ()
    """Arrows of state diagrams that were taken, and are not in healthy runs."""
    digest: str = ""


def where_raised(error: BaseException) -> str:
    """The file and line in which something was raised."""
    place = raised_at(error)
    return type(error).__name__ if place is None else f"{place[0].rpartition('/')[2]}:{place[1]}"
