"""A stretch of a recorded run: which sections are played, by players that begin at a keyframe."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, TypeVar

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.reader import Recording, Segment, kind_of, no_instant
from firmware_runtime.recording.blackbox.section import Kind, Section

P = TypeVar("P")


@dataclass(frozen=True, slots=True)
class Stretch:
    """Stretch that is run again: from the keyframe before `begin` up to and including `until`."""

    begin: int = 0
    until: int = NEVER

    def __post_init__(self) -> None:
        """Raise ConfigError for one that ends before it begins."""
        if self.until < self.begin:
            begin, until = (f"{each / SECOND:g}" for each in (self.begin, self.until))
            fault = f"expected an instant after --from {begin}"
            raise ConfigError.of_one(f"--until {until}", fault)


WHOLE: Final = Stretch()


def segments_of(recording: Recording, stretch: Stretch) -> list[Segment]:
    """The segments that a stretch is in. Raises ConfigError where none reaches its beginning."""
    segments = [each for each in recording.segments() if each.last_at >= stretch.begin]
    if not segments:
        raise no_instant(recording, stretch.begin)
    return [each for each in segments if each.first_at <= stretch.until]


def plays_of(
    recording: Recording, player: Callable[[Section], P], stretch: Stretch
) -> Iterator[tuple[P, Iterator[Section]]]:
    """Yield a player for each segment of a stretch, made by its beginning, and what it is to take.

    Raises ConfigError for a recording that has nothing to begin with.
    """
    for segment in segments_of(recording, stretch):
        sections = segment.from_instant(stretch.begin).sections()
        yield player(next(sections)), stretch_of(sections, stretch.until)


def began_earlier(recording: Recording, stretch: Stretch) -> str | None:
    """Say that it begins at the start, as no keyframe stands before; None if it does not.

    A run whose models hold what cannot be kept, such as a lock made on the way, has no keyframes.
    """
    begin, segments = stretch.begin, segments_of(recording, stretch)
    if begin == 0 or not segments:
        return None
    first = segments[0].from_instant(begin)
    if kind_of(first.contents[0]) != Kind.BUILD:
        return None
    has_one = any(kind_of(each) == Kind.KEYFRAME for each in first.contents)
    why = None if has_one else recording.no_keyframe()
    because = "" if why is None else f" ({why})"
    return f"begun at the start of the run: no keyframe is before {begin / SECOND:g} s{because}"


def stretch_of(sections: Iterator[Section], until: int) -> Iterator[Section]:
    """Sections up to and including an instant.

    What is no step has the instant at which it was; a step that was late for its own may follow.
    """
    beyond: list[Section] = []
    for section in sections:
        if not section.has_instant or section.at <= until:
            yield from beyond
            beyond.clear()
            yield section
        elif section.kind is Kind.STEP:
            return
        else:
            beyond.append(section)
