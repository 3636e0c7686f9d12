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
from types import FrameType
from typing import Final, TypeAlias

STOPS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
ENDS: Final[tuple[int, ...]] = (
    *(signal.SIGQUIT, signal.SIGUSR1, signal.SIGUSR2, signal.SIGPWR, signal.SIGIO),
    *(signal.SIGALRM, signal.SIGVTALRM, signal.SIGPROF, signal.SIGXCPU, signal.SIGSTKFLT),
    *range(signal.SIGRTMIN, signal.SIGRTMAX + 1),
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
    handle = _Handler(request_stop, reload, give_up)
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


class _Handler:
    """What a signal leads to."""

    def __init__(
        self,
        request_stop: Callable[[str], None],
        reload: Callable[[], None] | None,
        give_up: Callable[[], None],
    ) -> None:
        self._request_stop = request_stop
        self._reload = reload
        self._give_up = give_up
        self._interrupts = 0

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        """Reload, or ask for the end; from the second SIGINT on, give up as well."""
        if number == signal.SIGHUP and self._reload is not None:
            self._reload()
            return
        self._request_stop(signal_name(number))
        if number == signal.SIGINT:
            self._interrupts += 1
            if self._interrupts > 1:
                self._give_up()
