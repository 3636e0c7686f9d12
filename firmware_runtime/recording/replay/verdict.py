"""The verdict on a recording, or a stretch of it: whether its replay is the run, bit for bit."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Final

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import NEVER, SECOND, format_time
from firmware_runtime.errors import Status, text_of
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.blackbox.section import Kind, Section, count_of_unknown
from firmware_runtime.recording.blackbox.state_of_run import UNKEPT, places
from firmware_runtime.recording.recorded_board import changed_versions, versions_said
from firmware_runtime.recording.replay.difference import Difference, in_lines
from firmware_runtime.recording.replay.player import Player
from firmware_runtime.recording.replay.stretch import WHOLE, Stretch, began_earlier, plays_of
from firmware_runtime.statistics.number_formats import NO_DATES, Dates

NOTHING_AGAIN: Final = "nothing of it was run again: no step and no transfer is in it"


@dataclass(slots=True)
class Verdict:
    """Findings of a replay."""

    events: int = 0
    """Values that left ports, also those of a world."""
    values: int = 0
    """Values that left the robot's own ports, in the recording."""
    compared: int = 0
    """Own values that were compared as a whole."""
    played_back: int = 0
    """Values of a world on doubles, which are none of the robot's own."""
    values_not_compared: list[str] = field(default_factory=list)
    """Values that were not compared, by port and class, one text each."""
    unknown: int = 0
    """Values of which only a class is recorded, whole or in part, and compared."""
    steps: int = 0
    writes: int = 0
    """Transfers on buses and ports, each as often as it was tried."""
    duration: int = 0
    """Time of the run that was run again, ns."""
    differences: int = 0
    first: Difference | None = None
    faults: list[str] = field(default_factory=list)
    """Parts that are missing in the recording, one sentence each."""
    code_changed: list[str] = field(default_factory=list)
    """Modules of the robot whose source is another than in the run."""
    versions_changed: dict[str, dict[str, str | None]] = field(default_factory=dict)
    """Python and packages that are others, as `changed_versions` has them."""
    uncompared: int = 0
    """Keyframes whose state was not compared: the models of the changed code have another form."""
    has_drawn: bool = False
    """True if the process's own generators of random numbers were drawn from."""
    failure: str | None = None
    """Error that ended it, in a sentence: the robot raised it as it was run again."""
    end: str | None = None
    """Reason of a run that had failed; None for one that had not."""
    began_earlier: str | None = None
    """Sentence that it began at the start, with no keyframe before the instant asked for."""

    @property
    def is_identical(self) -> bool | None:
        """Return whether something was run again, all of it as it was, and nothing is missing.

        None where nothing differs, but not all that left the models was compared.
        """
        if not self.is_something or self.differences or self.faults:
            return False
        return None if self.not_compared else True

    @property
    def status(self) -> Status:
        """The exit status that says so."""
        return Status.of_comparison(self.is_identical)

    @property
    def in_words(self) -> str:
        """Findings in one sentence without an end."""
        if self.first is not None:
            return f"{self.differences} differences"
        if not self.is_something:
            return NOTHING_AGAIN
        if self.not_compared:
            return f"no difference in {self.compared} of {self.values} values"
        return f"{'no difference' if self.faults else 'identical'}: {self.values} values"

    @property
    def reason(self) -> str | None:
        """Reason why it is not identical, in a sentence; None if it is."""
        if self.first is not None:
            first = f"{self.first.what} of {self.first.where} at {format_time(self.first.at)}"
            return f"{self.differences} differences, the first in {first}"
        if not self.is_something:
            return NOTHING_AGAIN
        if self.faults:
            return f"not whole: {'; '.join(self.faults)}"
        if self.not_compared:
            return f"{self.in_words}; not compared: {'; '.join(self.not_compared)}"
        return None

    @property
    def not_compared(self) -> list[str]:
        """Values and states that were recorded and not compared, one sentence each."""
        found = list(self.values_not_compared)
        if self.uncompared:
            why = "other code has models of another form"
            found.append(f"the state at {self.uncompared} keyframes: {why}")
        return found

    @property
    def is_something(self) -> bool:
        """Return whether any was run again; of a start that failed, what its chips were asked."""
        return self.steps > 0 or self.writes > 0

    def add(self, player: Player) -> None:
        """Add what a player found."""
        self.events += player.events
        self.values += player.values.values
        self.compared += player.values.compared
        self.played_back += player.values.played_back
        self.values_not_compared += player.values.not_compared()
        self.steps += player.steps
        self.duration += max(0, player.at - player.began_at)
        self.differences += player.differences
        self.first = self.first or player.first
        self.uncompared += player.uncompared
        self.failure = None if player.failure is None else text_of(player.failure)
        self.end = player.end
        self.faults += [] if player.missing is None else [player.missing]

    def as_json(self, dates: Dates = NO_DATES) -> dict[str, object]:
        """For a program."""
        return {
            "identical": self.is_identical,
            "reason": self.reason,
            "events": self.events,
            "values": self.values,
            "compared": self.compared,
            "played_back": self.played_back,
            "not_compared": self.not_compared,
            "duration_s": self.duration / SECOND,
            "first_difference": None if self.first is None else self.first.as_json(dates),
            "differences": self.differences,
            "unknown": self.unknown,
            "states_not_compared": self.uncompared,
            "steps": self.steps,
            "transfers": self.writes,
            "faults": self.faults,
            "code_changed": self.code_changed,
            "versions_changed": self.versions_changed,
            "has_drawn": self.has_drawn,
            "began_earlier": self.began_earlier,
            "failure": self.failure,
            "end": self.end,
        }


def replay(
    recording: Recording,
    board: Board,
    stretch: Stretch = WHOLE,
    *,
    before: Callable[[Section], None] = lambda _: None,
    listener: Callable[[Difference], None] = lambda _: None,
) -> Verdict:
    """Run it again. `before` is called before each section, `listener` with each difference.

    Raises ConfigError for a recording that has nothing to begin with, or is none of this board.
    """

    def player(beginning: Section) -> Player:
        made = Player(recording.header, board, beginning)
        made.listeners.append(listener)
        return made

    return played(recording, player, stretch, before)


def played(
    recording: Recording,
    player_of: Callable[[Section], Player],
    stretch: Stretch,
    before: Callable[[Section], None],
) -> Verdict:
    """Let players take a stretch of a recording; ends where one of them cannot go on."""
    verdict = Verdict(
        faults=recording.faults(),
        versions_changed=changed_versions(recording.header.versions),
        began_earlier=began_earlier(recording, stretch),
    )
    for player, sections in plays_of(recording, player_of, stretch):
        stood, last = places(), None
        for section in sections:
            before(section)
            verdict.writes += len(section.transfers)
            verdict.unknown += count_of_unknown(section)
            player.take(section)
            last = section.kind
            if player.is_over:
                break
        if stretch.until == NEVER and last is Kind.STEP:
            player.went_on()
        verdict.add(player)
        verdict.has_drawn |= places() != stood
        verdict.code_changed = player.code_changed
        if player.is_over:
            break
    return verdict


def verdict_document(recording: Recording, verdict: Verdict, spent: int) -> dict[str, object]:
    """Return the verdict with the run that it is of, for JSON."""
    header = recording.header
    return {
        **verdict.as_json(recording.dates()),
        "run": header.run,
        "board": header.board,
        "role": header.role,
        "recording": str(recording.path),
        "code_sha256": header.code_sha256,
        "times_real_time": verdict.duration / max(spent, 1),
    }


def verdict_lines(recording: Recording, verdict: Verdict, spent: int) -> Iterator[str]:
    """Yield whether it was the same, the first difference, and what belongs to the verdict."""
    header = recording.header
    for fault in verdict.faults:
        yield f"not whole: {fault}"
    if verdict.first is not None:
        yield f"{verdict.differences} differences; the first:"
        yield from difference_in_words(verdict.first, recording.dates())
        if verdict.has_drawn:
            yield f"  {UNKEPT}"
    elif verdict.is_something and (verdict.not_compared or not verdict.faults):
        yield f"{verdict.in_words}, {verdict.writes} transfers of {header.run}"
    elif not verdict.is_something:
        yield NOTHING_AGAIN
    yield from (f"  not compared: {each}" for each in verdict.not_compared)
    duration, times = verdict.duration / SECOND, verdict.duration / max(spent, 1)
    digits = 0 if times >= 10 else 1
    speed = f"{times:.{digits}f} times real time"
    span = f"{duration:.3f} s of the run"
    yield f"  {verdict.steps} steps, {span}{recording.dates().said(0)}, {speed}"
    yield from _notes(verdict)


def _notes(verdict: Verdict) -> Iterator[str]:
    """What belongs to the verdict, a line each."""
    if verdict.began_earlier is not None:
        yield f"  {verdict.began_earlier}"
    if verdict.played_back:
        yield f"  {verdict.played_back} values of its world were played back"
    if verdict.failure is not None and verdict.differences == 0:
        yield f"  it ended so again: {verdict.failure}"
    elif verdict.end is not None:
        yield f"  the run had failed: {verdict.end}"
    if verdict.code_changed:
        yield f"  code that has changed since: {', '.join(verdict.code_changed)}"
    if verdict.versions_changed:
        said = versions_said(verdict.versions_changed)
        yield f"  versions that are others than in the run: {said}"


def difference_in_words(difference: Difference, dates: Dates = NO_DATES) -> Iterator[str]:
    """When, where, and both values."""
    yield from (f"  {line}" for line in in_lines(difference.as_json(dates)))
