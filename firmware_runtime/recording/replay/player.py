"""The player: takes the sections of a recording one by one, and does in each what the run did."""

from collections.abc import Callable, Sequence
from typing import Any, Final

import msgspec

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import with_all_below
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import (
    ConfigError,
    FirmwareRuntimeError,
    legible,
    raised_words,
    text_of,
)
from firmware_runtime.executive.account import ModelAccount
from firmware_runtime.executive.accounting import counts_of
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.recording.blackbox.ring_file import Header
from firmware_runtime.recording.blackbox.section import Kind, Section, pairs_of, sentences
from firmware_runtime.recording.blackbox.state.keyframes import (
    ForeignState,
    StateTable,
    UnkeepableState,
)
from firmware_runtime.recording.blackbox.state_of_run import state_of_run
from firmware_runtime.recording.recorded_board import changed_modules, changed_versions, code_of
from firmware_runtime.recording.replay.difference import NOTHING, Difference, model_and_field
from firmware_runtime.recording.replay.feed import Feed
from firmware_runtime.recording.replay.rebuilt_robot import (
    REPLAYED,
    Rebuilt,
    foreign_keyframe,
    rebuilt,
)
from firmware_runtime.recording.replay.section_comparison import (
    ComparedValues,
    differences_of_counts,
)
from firmware_runtime.recording.values import made_for
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.statistics import Statistics

_NO_KEYFRAMES: Final = "its keyframes are of no use"
_FAILED: Final = RunState.FAILED.name.lower()
_ENDS: Final = {state.name.lower(): state for state in RunState}
_ORDER: Final = ("step", "state", "value", "class", "write", "asked", "count", "end")
"""Order of differences at one instant."""


class _End(msgspec.Struct):
    """Content of a section ENDED."""

    state: str
    reason: str
    counts: dict[str, dict[str, int]]
    fault: str | None = None
    raised: str | None = None
    """Error that was raised, as `errors.raised_words` has it."""
    in_step: bool = False
    """True if that was in a step, and not around it."""


class Player:
    """A robot that is run again; `at` is the instant of the run that it has come to.

    `events` counts the values that it has sent, `differences` what was not as recorded, `first` is
    the first of these. `listeners` are called with each of them.
    """

    def __init__(self, header: Header, board: Board, beginning: Section) -> None:
        self.header = header
        self.events = 0
        self.differences = 0
        self.first: Difference | None = None
        self.at = 0
        self.began_at = beginning.at
        self.steps = 0
        self.end: str | None = None
        """Reason of a run that had failed; None for one that had not."""
        self.missing: str | None = None
        """Values that the run could not record, in a sentence."""
        self.uncompared = 0
        """Keyframes whose state is not compared: other code has models of another form."""
        self.failure: BaseException | None = None
        """Error that the robot raised in the step it came to last, if it did."""
        self.listeners: list[Callable[[Difference], None]] = []
        self._noted: list[Difference] = []
        self.feed = self._new_feed()
        if beginning.kind is Kind.BUILD:
            self.feed.load(beginning)
        found = self._rebuilt(board)
        self.robot, self.own, self.profiler = found.robot, found.own, found.profiler
        self.lines, self.simulator = found.lines, found.profiler.simulator
        self._ledger, self._sent, self.ports = found.ledger, found.sent, found.ports
        self.feed.check_all_taken()
        world = frozenset(header.world)
        self._models = {below_root(each.path) for each in with_all_below(found.robot.model)}
        self.table = self._state_table(found)
        played = [n for n, path in enumerate(self.ports) if path.rpartition(".")[0] in world]
        self.values = self._new_values(frozenset(played))
        if beginning.kind is Kind.BUILD:
            self._report()
        else:
            self.values.restart()
            self._noted.clear()  # how a robot is built for a replay was never recorded
            self._restore(beginning)

    @property
    def statistics(self) -> Statistics:
        """Counts so far, as in the run."""
        return self._ledger.statistics()

    @property
    def sent(self) -> Sequence[tuple[int, object]]:
        """Number of the port and value, for all that has been sent in this section so far."""
        return pairs_of(self._sent)

    @property
    def is_over(self) -> bool:
        """Return whether no more sections can be taken: a replay goes on to the run's end."""
        return False

    @property
    def code_changed(self) -> list[str]:
        """Modules of the robot whose source is another than in the run."""
        own = (each for each in self.simulator.atomics if each in self.own)
        return changed_modules(self.header.code, code_of(own))

    @property
    def accounts(self) -> Sequence[ModelAccount]:
        """Accounts of each model's activations."""
        return self.profiler.accounting.accounts

    def go_back(self, at: int, state: bytes) -> None:
        """Be in a state again that this robot was in. Raises ForeignState."""
        if self.table is None:
            raise ConfigError.of_one("replay", "this robot's state cannot be set back")
        if not isinstance(state, bytes):  # of a file that something has changed
            raise ConfigError.of_one("replay", _NO_KEYFRAMES, expected="its start")
        self.table.restore(state)
        self.at, self.failure = at, None
        self.values.restart()

    def take(self, section: Section) -> None:
        """Do what the run did in this section, and compare."""
        self._sent.clear()
        play = self._PLAYS.get(section.kind)
        if play is None:
            return
        self.feed.load(section)
        if self.failure is not None and section.kind is Kind.STEP:
            self._note_failure(section.at, NOTHING)
            self.failure = None
        try:
            getattr(self, play)(section)
        except (FirmwareRuntimeError, MemoryError):
            raise
        except (Exception, SystemExit) as error:  # noqa: BLE001 -- of a model, which ended the run
            self.failure = error
        self.feed.check_all_taken()
        self._compare_sent(section)
        self._report()

    def _rebuilt(self, board: Board) -> Rebuilt:
        """The robot. Raises ConfigError where its code fails on what is recorded."""
        try:
            return rebuilt(self.header, board, self.feed)
        except FirmwareRuntimeError:
            raise
        except Exception as error:
            fault = f"the robot cannot be put together on this recording ({raised_words(error)})"
            expected = "expected the code of the run, and a recording that nothing has changed"
            raise ConfigError.of_one("replay", f"{fault}; {expected}") from error

    def _new_feed(self) -> Feed:
        return Feed(self.header, self._note)

    def _new_values(self, played: frozenset[int]) -> ComparedValues:
        return ComparedValues(self.ports, played)

    # What each kind of section is -----------------------------------------------------------------

    def _probe(self, _section: Section) -> None:
        try:
            self.robot.find_chips()
        except Exception as error:  # noqa: BLE001 -- as the run did: it is over then
            self.failure = error

    def _go_on(self, section: Section) -> None:
        self._ledger.go_on(section.at)

    def _step(self, section: Section) -> None:
        at, step, simulator = section.at, self.profiler.step, self.simulator
        self.at = at
        self.steps += 1
        if not self._reach(section):
            return
        entering = self._entering(section)
        step.begin(at)
        try:
            for port, value in entering:
                simulator.inject(port, value)
            simulator.advance(at)
        except Exception as error:  # noqa: BLE001 -- as the run did: it is over then
            self.failure = error
        finally:
            self._commit()

    def _commit(self) -> None:
        """Enter a step into the ledger, and name why it was late."""
        self._ledger.commit(NEVER)
        if self._ledger.late.has_work:
            self._ledger.use_slack(NEVER)

    def _reach(self, section: Section) -> bool:
        """Return whether the robot is where it can make this step."""
        at, now, due = section.at, self.simulator.now, self.simulator.next_at
        if at != due and not (section.entered and now <= at < due):
            self._note(Difference(at, "step", "", "next event", at, due))
        return now <= at <= due

    def _entering(self, section: Section) -> list[tuple[Any, object]]:
        """Ports and values. Raises ConfigError for what is no value."""
        ports: dict[str, Any] = self.simulator.root.in_ports
        found: list[tuple[object, object]] = []
        for name, form in section.entered:
            if name not in ports:
                self._note(Difference(section.at, "value", "", name, form, NOTHING))
                continue
            found.append((ports[name], made_for(name, form)))
        return found

    def _make_safe(self, _section: Section) -> None:
        self.robot.make_safe()

    def _retune(self, section: Section) -> None:
        settings = made_for("settings", section.extra)
        self.robot.retune(self._in_force(settings))

    def _in_force(self, settings: object) -> object:
        """The settings that a run has taken up, as they are to be taken up here."""
        return settings

    def _exit(self, section: Section) -> None:
        said = sentences(self.simulator.exit())
        recorded = section.extra or []
        if said != recorded:
            self._note(Difference(section.at, "end", "", "exit", recorded, said))

    def _end(self, section: Section) -> None:
        self.at = section.at
        try:
            end = msgspec.convert(section.extra, _End)
        except msgspec.ValidationError as error:
            fault = f"its end is not the end of a run ({error}); expected state, reason, counts"
            raise ConfigError.of_one("recording", fault) from error
        self.missing = end.fault
        outcome = Outcome(_ENDS.get(end.state, RunState.FAILED), end.reason)
        self.end = end.reason if outcome.state is RunState.FAILED else None
        self._ledger.finish(outcome.state, section.at, outcome.reason)
        self._compare_failure(section.at, end)
        counted = counts_of(self.accounts, self.profiler.faults)
        self._noted += differences_of_counts(section.at, end.counts, counted)

    def _take_classes(self, section: Section) -> None:
        self.values.restart(section.extra)

    # State ----------------------------------------------------------------------------------------

    def _state_table(self, found: Rebuilt) -> StateTable | None:
        """The table of the robot's state; None if it has one that cannot be kept."""
        try:
            return state_of_run(
                *(found.robot, found.lines, found.profiler.state, found.own),
                (*REPLAYED, found.rig),
                chance=self.header.chance,
            )
        except UnkeepableState:
            return None

    def _restore(self, keyframe: Section) -> None:
        """Be in the state of a keyframe."""
        if self.table is None or not isinstance(keyframe.extra, bytes):
            raise ConfigError.of_one("replay", _NO_KEYFRAMES, expected="its start")
        try:
            self.table.restore(keyframe.extra)
        except ForeignState as error:
            raise foreign_keyframe(error, self.code_changed) from error
        self.at = keyframe.at
        self._compare_state(keyframe)

    def _compare_state(self, section: Section) -> None:
        """Compare what every model has become with what it was then."""
        if self.uncompared:  # nor can those that follow be
            self.uncompared += 1
            return
        if self.table is None or self.differences:  # what follows from a difference is none
            return
        try:
            for each in self.table.differences(section.extra):
                self._note_state(section.at, each.path, each.recorded, each.present)
        except UnkeepableState as error:
            self._note_state(section.at, error.path, "what can be kept", str(error))
        except ForeignState as error:
            if not self.code_changed and not changed_versions(self.header.versions):
                raise ConfigError.of_one("replay", f"a keyframe: {text_of(error)}") from error
            self.uncompared = 1

    # What is compared -----------------------------------------------------------------------------

    def _compare_failure(self, at: int, end: _End) -> None:
        """Compare what ended the run with what has been raised here: classes and text."""
        if self.failure is None:
            if end.in_step and end.raised is not None:
                self._note_failure(at, end.raised)
        elif end.raised is None:  # by a program that did not note it, or the run went on
            if end.state != _FAILED or end.reason != Outcome.of_error(self.failure).reason:
                self._note_failure(at, end.reason)
        elif end.raised != legible(raised_words(self.failure)):
            self._note_failure(at, end.raised)

    def went_on(self) -> None:
        """Take it that the run did not end with what was raised in the last step here."""
        if self.failure is not None:
            self._note_failure(self.at, NOTHING)
            self._report()

    def _note_failure(self, at: int, recorded: str) -> None:
        replayed = NOTHING if self.failure is None else legible(raised_words(self.failure))
        self._note(Difference(at, "end", "", "failure", recorded, replayed))

    def _compare_sent(self, section: Section) -> None:
        self.events += len(self._sent) // 2
        self._noted += self.values.differences(section, self._sent)

    def _note_state(self, at: int, path: str, *pair: object) -> None:
        self._note(Difference(at, "state", *model_and_field(path, self._models), *pair))

    def _note(self, difference: Difference) -> None:
        self._noted.append(difference)

    def _report(self) -> None:
        """Report the differences of a section: a cause before what follows from it."""
        self._noted.sort(key=lambda each: _ORDER.index(each.what))
        for difference in self._noted:
            self.differences += 1
            self.first = self.first or difference
            for listener in self.listeners:
                listener(difference)
        self._noted.clear()

    _PLAYS: Final = {
        Kind.PROBE: "_probe",
        Kind.GO_ON: "_go_on",
        Kind.STEP: "_step",
        Kind.SAFE: "_make_safe",
        Kind.RETUNED: "_retune",
        Kind.EXIT: "_exit",
        Kind.ENDED: "_end",
        Kind.KEYFRAME: "_compare_state",
        Kind.CLASSES: "_take_classes",
    }
