"""The verdict on a recording, or a stretch of it: whether its replay is the run, bit for bit."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import NEVER, SECOND, format_time
from firmware_runtime.errors import Status, text_of
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.blackbox.section import Kind, Section, count_of_unknown
from firmware_runtime.recording.blackbox.state_of_run import places
from firmware_runtime.recording.recorded_board import changed_versions
from firmware_runtime.recording.replay.difference import Difference
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
