"""The end of a run: its outputs are switched off, again and again while that fails.

A bus that is gone for a moment when a run ends must not leave a motor on. So what could not be
switched off is switched off again every 20 ms, as the guard does, for a stated while; only then is
it given up. Signals do not end that, but a second Ctrl-C does, see `signals`.
"""

from collections.abc import Callable
from contextlib import suppress

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import text_of
from firmware_runtime.executive.clocks import Clock

OFF_AGAIN_EVERY = 20 * MILLISECOND
"""Ns until outputs that could not be switched off are switched off again."""


class SwitchOffRetry:
    """Calls `make_safe` until it fails no more, for `keep_trying` ns of `clock` at most.

    `make_safe` returns what failed, one sentence each. `between` is called with the present
    instant before every attempt but the first.
    """

    def __init__(
        self,
        make_safe: Callable[[], list[str]],
        clock: Clock,
        keep_trying: int,
        between: Callable[[int], None],
    ) -> None:
        self._make_safe = make_safe
        self._clock = clock
        self._keep_trying = keep_trying
        self._between = between
        self._is_given_up = False

    def give_up(self) -> None:
        """Try no more after the attempt under way; safe in a signal handler and in any thread."""
        self._is_given_up = True

    def run(self) -> list[str]:
        """Switch off; return what failed the last time, one sentence each, and how often."""
        begun_at = self._clock.now()
        most = 1 + self._keep_trying // OFF_AGAIN_EVERY  # a clock may stand still
        failed = self._attempt()
        attempts = 1
        while failed and attempts < most and not self._is_given_up:
            now = self._wait()
            if now - begun_at > self._keep_trying:
                break
            failed = self._attempt()
            attempts += 1
        if failed and attempts > 1:
            spent_s = (self._clock.now() - begun_at) / SECOND
            failed.append(f"given up after {attempts} attempts in {spent_s:.2f} s")
        return failed

    def _wait(self) -> int:
        """Let the time to the next attempt pass; return the instant. Ctrl-C gives up."""
        try:
            self._clock.wait(self._clock.now() + OFF_AGAIN_EVERY, ())
        except KeyboardInterrupt:
            self.give_up()
        now = self._clock.now()
        with suppress(Exception):  # nothing keeps the outputs from being switched off
            self._between(now)
        return now

    def _attempt(self) -> list[str]:
        try:
            return list(self._make_safe())
        except BaseException as error:  # noqa: BLE001 -- reported, and the run still has to end
            return [f"make_safe raised {type(error).__name__}: {text_of(error)}"]
