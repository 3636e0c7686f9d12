"""Settings that a run is driven by, those of them that change while it does, and their reload."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from msgspec.structs import replace

from firmware_runtime.board import registry
from firmware_runtime.board.registry import Board
from firmware_runtime.board.retuning import (
    changed_keys,
    has_key,
    need_restart,
    retunable_values,
    retuned,
    settings_with,
)
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError, suggested, text_of
from firmware_runtime.executive.executive import Executive
from firmware_runtime.system.messages import Notices

if TYPE_CHECKING:
    from firmware_runtime.board.ends import BoardEnd


def tuning_of(board: Board, end: "BoardEnd | None", retune: Callable[[object], None]) -> "Tuning":
    """The gains and limits of a robot, or of one end of it: those that a model there takes up."""
    if end is None:
        return Tuning(board, retune)
    from firmware_runtime.board.ends import gains_elsewhere, other_end  # noqa: PLC0415 -- few runs

    elsewhere = gains_elsewhere(board, end)
    other = other_end(board, end).name if elsewhere else ""
    return Tuning(board, retune, dict.fromkeys(elsewhere, other))


class Tuning:
    """A robot's gains and limits; `board` has them as they are, `revision` counts the changes.

    `retune` lets the robot take up settings. Keys that only the other end of a robot in two
    processes takes up are none of this run's: `elsewhere` has the name of that end's run.
    """

    def __init__(
        self, board: Board, retune: Callable[[Any], None], elsewhere: Mapping[str, str] = {}
    ) -> None:
        self.board = board
        self.revision = 0
        self._retune = retune
        self._elsewhere = elsewhere

    @property
    def values(self) -> dict[str, object]:
        """Gains and limits that may change while the robot runs, by key."""
        values = retunable_values(self.board.settings, self.board.retunable)
        return {key: value for key, value in values.items() if key not in self._elsewhere}

    def set(self, values: Mapping[str, object]) -> list[str]:
        """Take up all of these values, or none; return the keys that changed.

        Raises ConfigError with every fault: an unknown key, one that only a new run takes up, and
        whatever the board's file would be refused for.
        """
        known = self.values
        faults = [self._why_not(key) for key in values if key not in known]
        settings = None
        try:
            judged = {key: value for key, value in values.items() if key in known}
            settings = settings_with(self.board, judged)
        except ConfigError as error:
            faults += error.faults
        if faults:
            raise ConfigError(self.board.name, faults)
        return self.take_up(settings)[0]

    def take_up(self, settings: object) -> tuple[list[str], list[str]]:
        """Take up what may change now; return those keys, and those that only a new run takes up.

        Nothing else is touched: channels that are not written any more would keep their last
        duties. What the robot fails to take up is undone, and raises ConfigError; ModelError where
        that fails too: then it is not known what the robot goes by.
        """
        before, retunable = self.board.settings, self.board.retunable
        changed = list(changed_keys(before, settings))
        left = need_restart(changed, retunable)
        settings = retuned(before, settings, retunable)
        try:
            self._apply(settings)
        except ConfigError:
            self._undo(before)
            raise
        self.board = replace(self.board, settings=settings)
        self.revision += 1
        return [key for key in changed if key not in left], left

    def _apply(self, settings: object) -> None:
        try:
            self._retune(settings)
        except Exception as error:
            found = f"retune: {type(error).__name__}: {text_of(error)}"
            raise ConfigError.of_one(f"robot {self.board.name}", found) from error

    def _undo(self, before: object) -> None:
        try:
            self._apply(before)
        except ConfigError as error:
            raise ModelError(f"{error}; its gains are not known any more") from error

    def _why_not(self, key: str) -> str:
        if key in self._elsewhere:
            other = self._elsewhere[key]
            return f"{key}: no model of this end takes it up; expected `set {other} {key}=VALUE`"
        known = self.values
        expected = f"expected one of {', '.join(known) or 'none: this board has no such keys'}"
        if has_key(self.board.settings, key):
            return f"{key}: not to be changed while the robot runs: a new run takes it; {expected}"
        return f"{key}: unknown key; {suggested(key, known, expected)}"


NEEDED = 5 * MILLISECOND
"""Ns that reading a board's file may take; 2.4 ms on a PC."""
TIMEOUT = SECOND
"""Ns after which it is read all the same: a fast loop never has that much time."""


class Reloading:
    """A hook: reads the board's file again on request (SIGHUP), between two steps far enough apart.

    A file with any fault changes nothing. What only a new run can take up is named and left as it
    is. `log` gets the result, a sentence.
    """

    def __init__(
        self,
        tuning: Tuning,
        executive: Executive,
        notices: Notices,
        log: Callable[[str], None],
    ) -> None:
        self._tuning = tuning
        self._executive = executive
        self._notices = notices
        self._log = log
        self._is_asked = False
        self._at_latest = 0
        executive.hooks.append(self)

    def request(self) -> None:
        """Read it again after the step under way; safe in a signal handler."""
        self._at_latest = self._executive.clock.now() + TIMEOUT
        self._is_asked = True
        self._executive.inbox.wake()

    def between_steps(self, now: int, left: int) -> None:
        """Reload on request, as soon as it makes no activation late."""
        if self._is_asked and (left >= NEEDED or now >= self._at_latest):
            self._is_asked = False
            self._notices.reloading()
            self._log(self._reload())
            self._notices.ready()

    def _reload(self) -> str:
        own = self._tuning.board
        try:
            board = registry.load(str(own.source), own.assignments, running=own.kind)
        except Exception as error:  # noqa: BLE001 -- whatever the file holds, the run goes on
            said = error if isinstance(error, ConfigError) else f"{type(error).__name__}: {error}"
            return f"not reloaded, everything stays as it was: {said}"
        if board.name != own.name:
            now = f"{board.source} is now of {board.name}; expected {own.name}"
            return f"not reloaded, everything stays as it was: {now}"
        try:
            taken, left = self._tuning.take_up(board.settings)
        except ConfigError as error:
            return f"not reloaded, everything stays as it was: {error}"
        parts = [f"reloaded {own.source}: {', '.join(taken) or 'nothing new'}"]
        if left:
            parts.append(f"only a new run takes up {', '.join(left)}")
        return "; ".join(parts)
