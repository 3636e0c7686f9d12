"""How a run ends: its outputs are switched off, devices say whether they ever worked.

A bus that is gone for a moment when a run ends must not leave a motor on. So what could not be
switched off is switched off again every 20 ms, as the guard does, for a stated while; only then is
it given up. Signals do not end that, but a second Ctrl-C does, see `signals`.

A run without one of its devices controlled nothing. A device is a model that says by `unready`
whether it works. From the start of a run those that do not are polled between two steps until each
has worked once; then none is polled any more. One that came up and then failed in every use
(`failed_uses`) did not work either; that is judged at the end.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Protocol, Self, runtime_checkable

from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND, format_time
from firmware_runtime.errors import place_of_bug, text_of
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.executive.fault_log import FaultLog
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.statistics.file_header import RunState


class Outcome(Struct, frozen=True):
    """The end of a run, after its outputs were made safe.

    `state` is ENDED (at the instant asked for, or nothing was due any more), STOPPED (on request),
    OVERRUN (by a policy) or FAILED (something was raised, or a device was never ready); `reason`
    says in a sentence what happened; `error` is what was raised, if something was. `faults` are
    sentences on what could not be made safe or exited.
    """

    state: RunState
    reason: str
    error: BaseException | None = None
    faults: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """The reason, and the place in a program where a bug showed."""
        return f"{self.reason}{place_of_bug(self.error)}"

    @classmethod
    def reached(cls, until: int) -> Self:
        """Of a run that has come to the instant asked for."""
        at = (
            "nothing is due any more" if until == NEVER else f"the run reached {format_time(until)}"
        )
        return cls(RunState.ENDED, at)

    @classmethod
    def of_error(cls, error: BaseException) -> Self:
        """Of a run in which something was raised; Ctrl-C is a request to stop."""
        if isinstance(error, KeyboardInterrupt):
            return cls(RunState.STOPPED, "SIGINT")
        return cls(RunState.FAILED, text_of(error) or type(error).__name__, error)


@runtime_checkable
class Device(Protocol):
    """A model of hardware that can say whether it works."""

    path: str

    def unready(self) -> str | None:
        """Why it does not work, in a few words that follow its name; None if it does."""


@runtime_checkable
class ProvenByUse(Protocol):
    """A device that is not proven by coming up: it can say that no use of it was good."""

    path: str

    def failed_uses(self) -> int:
        """How often it was used and failed, if it always did; 0 if a use was ever good."""


LEAST_USES = 3
"""A device that failed in fewer uses may have been about to work."""


class Readiness:
    """`waiting` are the devices that have not been ready yet, with their paths."""

    def __init__(self, simulator: Engine, faults: FaultLog) -> None:
        self.waiting: list[tuple[str, Device]] = [
            (below_root(atomic.path), atomic)
            for atomic in simulator.atomics
            if isinstance(atomic, Device) and atomic.unready() is not None
        ]
        self._proven_by_use = [
            (below_root(atomic.path), atomic)
            for atomic in simulator.atomics
            if isinstance(atomic, ProvenByUse)
        ]
        self._faults = faults

    def require(self, device: Device) -> None:
        """Judge one more, that is none of the model's."""
        self.waiting.append((device.path, device))

    def has_worked(self, device: Device) -> bool:
        """Return whether a device has been ready since the start."""
        return all(each is not device for _, each in self.waiting)

    def poll(self) -> None:
        """Ask the devices that have not been ready yet."""
        self.waiting = [each for each in self.waiting if each[1].unready() is not None]

    def judged(self, outcome: Outcome) -> Outcome:
        """The outcome of a run that is over: failed, with the cause, if a device never worked.

        A run that was stopped while devices still came up, none of which reported a fault, has not
        failed; what failed for another reason keeps that.
        """
        try:
            return self._judged(outcome)
        except BaseException as error:  # noqa: BLE001 -- the run still has to end
            if outcome.error is not None:  # which may have broken the device, too
                return outcome
            reason = f"a model's unready raised {type(error).__name__}: {text_of(error)}"
            return Outcome(RunState.FAILED, reason, error)

    def so_far(self, outcome: Outcome) -> Outcome:
        """The outcome of a run that pauses: devices that are still coming up have not failed."""
        judged = self.judged(outcome)
        if judged.state is not RunState.FAILED or judged.error is not None or self._have_failed():
            return judged
        waiting = "; ".join(f"{path} {device.unready()}" for path, device in self.waiting)
        return replace(outcome, reason=f"{outcome.reason}; so far {waiting}")

    def _judged(self, outcome: Outcome) -> Outcome:
        self.poll()
        reason = "; ".join(self._sentences())
        if reason and outcome.state is RunState.ENDED:
            return replace(outcome, state=RunState.FAILED, reason=reason)
        if self._have_failed() and outcome.state is RunState.STOPPED:
            return replace(outcome, state=RunState.FAILED, reason=f"{reason} ({outcome.reason})")
        return outcome

    def _have_failed(self) -> bool:
        has_faults = any(self._faults.last_of(path) is not None for path, _ in self.waiting)
        return has_faults or any(True for _ in self._always_failed())

    def _always_failed(self) -> Iterator[str]:
        """Sentences on the devices that came up, and failed in every use."""
        waiting = {path for path, _ in self.waiting}
        for path, device in self._proven_by_use:
            uses = device.failed_uses()
            if uses >= LEAST_USES and path not in waiting:
                last = self._faults.last_of(path)
                cause = "" if last is None else f": {last.sentence}"
                yield f"{path} failed {uses} of {uses} times{cause}"

    def _sentences(self) -> Iterator[str]:
        for path, device in self.waiting:
            why, last = device.unready(), self._faults.last_of(path)
            cause = "" if last is None or last.sentence in str(why) else f": {last.sentence}"
            yield f"{path} was never ready: it {why}{cause}"
        yield from self._always_failed()


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


class Ending:
    """Ends a run: outputs off, the models' exit, and off again, whatever an exit has done."""

    def __init__(
        self,
        exit_models: Callable[[], list[Exception]],
        readiness: Readiness,
        switching_off: SwitchOffRetry,
    ) -> None:
        self._exit_models = exit_models
        self._readiness = readiness
        self._switching_off = switching_off

    def give_up(self) -> None:
        """Switch off once, and not again if that fails; safe in a signal handler, in any thread."""
        self._switching_off.give_up()

    def __call__(self, outcome: Outcome) -> Outcome:
        """The outcome in the light of what devices say of themselves, and what goes wrong here."""
        faults = self._switching_off.run()
        outcome = self._readiness.judged(outcome)
        failures = self._exit_models()
        if failures or not faults:  # an exit may have switched something on, knowing it or not
            faults = self._switching_off.run()
        faults += [f"exit: {text_of(error)}" for error in failures if not _is_of_the_world(error)]
        return replace(outcome, faults=tuple(faults))


def _is_of_the_world(failure: Exception) -> bool:
    """Whether a model's exit failed on its bus: then what counts is whether outputs are off."""
    return isinstance(failure.__cause__, HalError)
