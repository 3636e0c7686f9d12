"""Signals that stop a run in order, in place of ending or halting it between two instructions.

SIGTERM (systemd), SIGINT (Ctrl-C) and SIGHUP (terminal gone) ask for the end: the loop ends after
the step under way, and outputs are made safe, again and again while that fails. A second SIGINT
gives that up. Where something may be driven so does every other signal that would end the process
by default (`ENDS`), such as Ctrl-backslash or a timer's, unless the program handles it. And a
terminal halts nothing there: Ctrl-Z asks for the end, and output from the background goes on.

SIGABRT stays as it is: by it systemd ends a run that hangs, in which no handler would be called.
"""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from select import select
from types import FrameType
from typing import Final, TypeAlias

from firmware_runtime.errors import Status
from firmware_runtime.system.resources import WakeUp
from firmware_runtime.system.this_system import IS_LINUX

STOPS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
_OF_LINUX: Final = (
    (signal.SIGPWR, signal.SIGSTKFLT, *range(signal.SIGRTMIN, signal.SIGRTMAX + 1))
    if IS_LINUX
    else ()
)
ENDS: Final[tuple[int, ...]] = (
    *(signal.SIGQUIT, signal.SIGUSR1, signal.SIGUSR2, signal.SIGIO, signal.SIGALRM),
    *(signal.SIGVTALRM, signal.SIGPROF, signal.SIGXCPU, *_OF_LINUX),
)
"""Others that end a process by default, and that no fault of its own program sends."""
_Handlers: TypeAlias = dict[int, Callable[[int, FrameType | None], object] | int | None]
"""By signal, as `signal.getsignal` has them."""
_WRITES_AND_READS: Final = (signal.SIGTTOU, signal.SIGTTIN)
"""Of a terminal, from the background; they halt a process by default."""


def signal_name(number: int) -> str:
    """The name of a signal, such as SIGTERM or SIGRTMIN+3."""
    try:
        return signal.Signals(number).name
    except ValueError:  # most of those of real time have none of their own
        return f"SIGRTMIN+{number - signal.SIGRTMIN}"


def signal_number(name: str) -> int:
    """The signal whose name `signal_name` gives."""
    return next(each for each in signal.valid_signals() if signal_name(each) == name)


@contextmanager
def stop_on_signals(
    request_stop: Callable[[str], None],
    reload: Callable[[], None] | None = None,
    give_up: Callable[[], None] = lambda: None,
    *,
    is_driving: bool = False,
) -> Iterator[None]:
    """Within the block, call `request_stop` with a signal's name; afterwards all is as it was.

    With `reload`, SIGHUP calls that instead: a service has no terminal that could go. `give_up` is
    called from the second SIGINT on. With `is_driving` nothing else that can be handled ends or
    halts this process either. Main thread only, as Python allows no other to handle signals.
    """
    interrupts = 0

    def handle(number: int, _frame: FrameType | None) -> None:
        nonlocal interrupts
        if number == signal.SIGHUP and reload is not None:
            reload()
            return
        request_stop(signal_name(number))
        if number == signal.SIGINT:
            interrupts += 1
            if interrupts > 1:
                give_up()

    before: _Handlers = {number: signal.signal(number, handle) for number in STOPS}
    if is_driving:
        for number in (*ENDS, signal.SIGTSTP):
            if signal.getsignal(number) is signal.SIG_DFL:
                before[number] = signal.signal(number, handle)
        before |= {each: signal.signal(each, signal.SIG_IGN) for each in _WRITES_AND_READS}
    try:
        yield
    finally:
        _set_back(before)


@contextmanager
def signals_held() -> Iterator[None]:
    """Within the block one of `STOPS` waits; it is handled at the block's end.

    For what must be whole before a handler may raise, as the start of a process that is to be ended
    then. Main thread only.
    """
    held: list[int] = []
    before: _Handlers = {
        each: signal.signal(each, lambda came, _: held.append(came)) for each in STOPS
    }
    try:
        yield
    finally:
        _set_back(before)
        for came in held:
            signal.raise_signal(came)


def _set_back(handlers: _Handlers) -> None:
    for number, handler in handlers.items():
        # None: set by something that is not Python, and out of reach
        signal.signal(number, signal.SIG_DFL if handler is None else handler)


def status_by(name: str) -> Status:
    """The exit status of a command that this signal stopped."""
    return Status.INTERRUPTED if name == "SIGINT" else Status.TERMINATED


class Signalled(SystemExit):
    """A signal asks this process to stop: no package's code has raised it."""


@contextmanager
def exit_on_signals() -> Iterator[None]:
    """Within the block the first signal that asks to stop raises Signalled; later ones do not.

    What the block is in the middle of is left by the way of any error: files go, processes end.
    """
    has_come = False

    def leave(name: str) -> None:
        nonlocal has_come
        if not has_come:
            has_come = True
            raise Signalled(status_by(name))

    with stop_on_signals(leave):
        yield


class UntilSignal:
    """Within `until_signal`: `came` is whether one has, `wait` waits for it."""

    def __init__(self) -> None:
        self.came = False
        self.name = ""
        """The signal that came last, such as SIGINT."""
        self._wake_up = WakeUp()

    def fileno(self) -> int:
        """The descriptor that becomes readable when a signal has come."""
        return self._wake_up.fileno()

    def take(self) -> None:
        """Let the descriptor be readable no more, until the next one comes."""
        self._wake_up.clear()

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait, for so long at most; return whether a signal has come."""
        select([self], (), (), timeout_s)
        return self.came

    def stop(self, name: str) -> None:
        """A signal has come."""
        self.came = True
        self.name = name
        self._wake_up.ring()

    def close(self) -> None:
        """Release the descriptor."""
        self._wake_up.close()


@contextmanager
def until_signal(*, is_driving: bool = False) -> Iterator[UntilSignal]:
    """Within the block a signal that would end this process ends the waiting.

    `is_driving` as for `stop_on_signals`.
    """
    waiting = UntilSignal()
    try:
        with stop_on_signals(waiting.stop, is_driving=is_driving):
            yield waiting
    finally:
        waiting.close()
