"""Removing a board's service: what is not there any more is no fault."""

import shlex
from collections.abc import Callable, Iterator

from firmware_runtime.errors import StepFailed
from firmware_runtime.host.installation.plan import (
    BRIDGE,
    GUARD,
    METRICS,
    RECORDER,
    RECORDS,
    ROS2,
    RUNTIME,
    RUNTIME_DIRECTORY,
    SERVICES,
    UNITS,
    WANTED,
    WITH_DEVICES,
    boards_among,
    drop_in_path,
    instance,
    settings_path,
    shared_files,
    unit_path,
)
from firmware_runtime.host.installation.target import Target, Words, run, state_of
from firmware_runtime.system.atomic_file import SERVICE_USER

Log = Callable[[str], None]


def installed_boards(target: Target) -> list[str]:
    """The boards that are installed, in order."""
    found = boards_among(target.tree.names(UNITS))
    return [board for board in found if target.tree.exists(drop_in_path(RUNTIME, board))]


class Removal:
    """A board about to be removed from a target; `purge` takes the user's copy and user too."""

    def __init__(self, board: str, target: Target, *, purge: bool) -> None:
        self._board = board
        self._target = target
        self._purge = purge
        self._is_last = not [each for each in installed_boards(target) if each != board]

    def preview(self, log: Log) -> None:
        """Show what would be run and removed, in order."""
        for words in self._commands_before():
            log(f"$ {shlex.join(words)}")
        for path in self._paths():
            log(f"to be removed: {self._target.tree.where(path)}")
        for words in (*self._commands_after(), *self._farewell("passwd", "userdel")):
            log(f"$ {shlex.join(words)}")

    def carry_out(self, log: Log) -> None:
        """Stop it, which makes its outputs safe, and remove it.

        Raises StepFailed, also when it ran and did not end safely: its guard and its files stay.
        """
        tree = self._target.tree
        self._stop(log)
        for path in self._paths():
            tree.remove(path)
            log(f"removed: {tree.where(path)}")
        for words in self._commands_after():
            run(words, log)
        # userdel removes the group with the user, unless the system is set up otherwise
        for accounts, program in (("passwd", "userdel"), ("group", "groupdel")):
            for words in self._farewell(accounts, program):
                run(words, log)

    def what_stays(self) -> list[str]:
        """Return what is left on purpose."""
        if self._purge:
            return []
        kept = (settings_path(self._board), self._records, RUNTIME_DIRECTORY)
        tree = self._target.tree
        stays = [str(tree.where(path)) for path in kept if tree.exists(path)]
        return [*stays, *([f"user and group {SERVICE_USER}"] if self._target.is_live else [])]

    def _stop(self, log: Log) -> None:
        unit = instance(RUNTIME, self._board)
        commands = list(self._commands_before())
        ran = bool(commands) and state_of(unit).is_active
        for words in commands:
            run(words, log)
            if ran and words[-1] == unit and (result := state_of(unit).result) != "success":
                raise StepFailed(
                    f"ended with {result}, so outputs may be on; cut the power of its "
                    "motors, then repeat this",
                    where=unit,
                )

    @property
    def _records(self) -> str:
        return f"{RECORDS}/{self._board}"

    def _paths(self) -> list[str]:
        """Return what there is to remove."""
        board, tree = self._board, self._target.tree
        paths = [f"{WANTED}/{instance(service, board)}" for service in SERVICES]
        paths += [drop_in_path(service, board) for service in WITH_DEVICES]
        if self._is_last:
            paths += [file.path for file in shared_files()]
        if self._purge:
            paths += [settings_path(board), self._records]
            left = [name for name in tree.names(RUNTIME_DIRECTORY) if _is_of(name, board)]
            paths += (f"{RUNTIME_DIRECTORY}/{name}" for name in left)
            paths += [RUNTIME_DIRECTORY] if self._is_last else []
        return [path for path in paths if tree.exists(path)]

    def _commands_before(self) -> Iterator[Words]:
        if self._target.is_live and self._target.tree.exists(unit_path(RUNTIME)):
            for service in (RUNTIME, ROS2, BRIDGE, METRICS, RECORDER, GUARD):
                yield ("systemctl", "disable", "--now", instance(service, self._board))
            yield ("systemctl", "reset-failed", instance(f"{RUNTIME}*", self._board))

    def _commands_after(self) -> Iterator[Words]:
        if self._target.is_live:
            yield ("systemctl", "daemon-reload")
            if self._is_last and self._target.has_device_manager:
                yield ("udevadm", "control", "--reload")

    def _farewell(self, accounts: str, program: str) -> Iterator[Words]:
        """Removing the service's own user or group, if it is there and no longer needed."""
        if not (self._target.is_live and self._purge and self._is_last):
            return
        lines = (self._target.tree.content(f"/etc/{accounts}") or b"").splitlines()
        if any(line.startswith(f"{SERVICE_USER}:".encode()) for line in lines):
            yield (program, SERVICE_USER)


def _is_of(name: str, board: str) -> bool:
    """Return whether a file of the runtime directory is a board's, such as `tachobot.stats`."""
    return name.lstrip(".").startswith(f"{board}.")
