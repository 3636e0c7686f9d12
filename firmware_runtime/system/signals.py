"""Signals that ask a run to stop: SIGTERM (systemd), SIGINT (Ctrl-C), SIGHUP (terminal gone).

Any of them would by default end the process between two instructions and leave the outputs as they
are. Here they only ask: the loop ends after the step under way, and outputs are made safe, again
and again while that fails. A second SIGINT gives that up.
"""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

STOPS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


@contextmanager
def stop_on_signals(
    request_stop: Callable[[str], None],
    reload: Callable[[], None] | None = None,
    give_up: Callable[[], None] = lambda: None,
) -> Iterator[None]:
    """Within the block, call `request_stop` with a signal's name; afterwards all is as it was.

    With `reload`, SIGHUP calls that instead: a service has no terminal that could go. `give_up` is
    called from the second SIGINT on. Main thread only, as Python allows no other to handle signals.
    """
    handle = _Handler(request_stop, reload, give_up)
    before = {number: signal.signal(number, handle) for number in STOPS}
    try:
        yield
    finally:
        for number, handler in before.items():
            # None: set by something that is not Python, and out of reach
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


@contextmanager
def signals_held() -> Iterator[None]:
    """Within the block such a signal waits; it is handled at its end.

    For what must be whole before a handler may raise, as the start of a process that is to be ended
    then. Main thread only.
    """
    held: list[int] = []
    before = {number: signal.signal(number, lambda came, _: held.append(came)) for number in STOPS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        for came in held:
            signal.raise_signal(came)


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
        self._request_stop(signal.Signals(number).name)
        if number == signal.SIGINT:
            self._interrupts += 1
            if self._interrupts > 1:
                self._give_up()
