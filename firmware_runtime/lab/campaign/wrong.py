"""What is wrong with a robot in which no fault was made, by what it says and does."""

from msgspec import Struct

from firmware_runtime.lab.campaign.stated import Stated
from firmware_runtime.lab.campaign.verdict import where_raised
from firmware_runtime.lab.campaign.watched import Watched


class Wrong(Struct, frozen=True):
    """What is wrong with a mission in which no fault was made."""

    oracle: str
    model: str
    what: str
    at: int
    seed: int | None = None
    """The seed of the world that shows it; None is the mission's own."""
    setting: str | None = None
    """What its rig names in which it shows, `KEY=VALUE`; None is in the mission's own settings."""


def wrong_by_itself(watched: Watched, stated: Stated) -> Wrong | None:
    """Return what is wrong with a robot in which no fault was made, by what it says and does."""
    said = watched.said_wrongly(stated.warned)
    if said is not None:
        what = f"reports {said.kind} ({said.sentence}), and no fault was made"
        return Wrong("invented", said.model, what, said.at)
    ending = watched.session.task.ending
    if ending is not None and ending.failed:
        return Wrong("own", "world", f"{ending.reason}, and no fault was made", watched.at)
    asked, at = watched.asked, watched.at
    for oracle, why in (("own", asked.judged()), ("on", asked.lost()), ("missed", asked.missed())):
        if why is not None:
            return Wrong(oracle, "world", f"{why}, and no fault was made", at)
    for note in asked.notes:
        return Wrong("misused", _device_in(note, watched), f"{note}; no fault was made", at)
    return None


def broken_by_itself(watched: Watched) -> Wrong | None:
    """Return that a robot in which no fault was made has failed, or sends no finite number."""
    outcome = watched.outcome
    if outcome is not None and outcome.error is not None:
        where = where_raised(outcome.error)
        return Wrong("crash", where, f"{outcome.reason}, and no fault was made", watched.at)
    for path, at in watched.not_finite.items():
        what = "it has sent a number that is not finite, and no fault was made"
        return Wrong("not-finite", path, what, at)
    return None


def _device_in(note: str, watched: Watched) -> str:
    """Return the device whose chip a note begins with, and whose address it has; else the world."""
    places = watched.session.hardware.struck.places
    named = [each for each in places if not each.is_line and note.startswith(each.chip)]
    marked = [each for each in named if each.address and f" 0x{each.address:02x}:" in note]
    return next((each.name for each in (*marked, *named)), "world")
