"""A run in the hands of a program: run it for a while, look at it, put values in, go on."""

import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NoReturn, TypeVar

from firmware_runtime.devs.coupled import ports_below
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import InPort, Listener, Listening, OutPort
from firmware_runtime.devs.time import NEVER, SECOND, format_time, seconds
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, UnknownName
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.runs.options import end_after, positive
from firmware_runtime.runs.session import quitting_is_a_bug
from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.port_values import PortValues
from firmware_runtime.system.resources import Closing
from firmware_runtime.system.signals import signal_number, stop_on_signals

if TYPE_CHECKING:
    from firmware_runtime.links.dover.dover import DoverLink

T = TypeVar("T")

_BY_SIGNAL: Final = 128
"""An exit status above this says by which signal a program ended."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """Result of a run, or its state where it may go on.

    `state` is ENDED (at the requested instant, or nothing was due any more), STOPPED (by a signal,
    on request, or because the robot's task is over), OVERRUN (by a policy, or because the loop
    cannot keep up with the clock) or FAILED (a device was never ready, or the robot's task failed);
    `reason` says it in a sentence.
    """

    state: RunState
    reason: str
    at: int
    """The instant of the run, ns since its start."""
    statistics: Figures = field(repr=False)

    @property
    def at_s(self) -> float:
        """The instant of the run in seconds."""
        return self.at / SECOND


class OpenRun(Closing):
    """A model on its executive, open until `close`; a context manager.

    Between two calls of `run` the run stands still: no time of its own passes. A run that a signal
    stops is ended in order first. If it had a length, the program learns of it as of any signal: by
    KeyboardInterrupt for SIGINT, by SystemExit for any other; without one, a signal is its end, and
    the result says which. Signals are taken in the main thread only.
    """

    def __init__(self, executive: Executive, dover: "DoverLink | None" = None) -> None:
        self.dover = dover
        """What the model's blocks of `models.dover` have sent and received; None if it has none."""
        self._executive = executive
        self._until = 0
        self._watched: dict[str, PortValues[object]] = {}
        self._is_closed = False
        self._running = threading.Lock()

    def __repr__(self) -> str:
        executive = self._executive
        how = "over" if self._is_closed or executive.is_over else "open"
        name = executive.simulator.root.name
        return f"<{type(self).__name__} {name}: {how}, at {executive.reached / SECOND:g} s>"

    @property
    def statistics(self) -> Figures:
        """Figures that have been counted so far."""
        return self._executive.statistics.figures()

    def show(self) -> None:
        """Show the report so far in a notebook. Raises ConfigError where none runs this."""
        self._executive.statistics.show()

    def run(self, for_s: float | None = None) -> RunResult:
        """Run for so many seconds, or until it is over or stopped; again, go on from there.

        Raises the ModelError of a bug in the model, ConfigError for a length that is none, and
        RuntimeError for a run that is over. When it raises, the run has ended in order.
        """
        if self._is_closed or self._executive.is_over:
            raise RuntimeError("the run is over; expected one that is open, and not stopped")
        until = end_after(self._until, for_s)
        model = self._executive.simulator.root
        with (
            self._alone(),
            _signals_taken(self._executive) as taken,
            quitting_is_a_bug(model),
        ):
            outcome = self._run_to(until)
        self._raise_what_failed(outcome)
        if taken and for_s is not None:
            self.close()
            _raise_for(taken[0])
        self._until = self._executive.reached if until == NEVER else until
        return self._result(outcome)

    def request_stop(self, reason: str = "on request") -> None:
        """End the run after the step under way, for this reason; safe in any thread."""
        self._executive.request_stop(reason)

    def post(self, port: InPort[T], value: T) -> bool:
        """Hand a value to an input port of the model, now; never blocks, safe in any thread.

        Returns False, and the value is counted as dropped, when too many wait. Raises ModelError
        for a port that is none of the model's own inputs, or a value that it does not carry.
        """
        self._executive.simulator.check_input(port, value)
        return self._executive.inbox.post(port, value)

    def plan(self, at_s: float, port: InPort[T], value: T) -> None:
        """Let a value arrive at an input port at that second of the run; not while it runs.

        Raises ModelError as `post` does, ConfigError for an instant that is none.
        """
        self._executive.simulator.check_input(port, value)
        at = 0 if at_s == 0 else seconds(positive("at_s", at_s))
        if at < self._until:
            passed = f"the run is at {format_time(self._until)}"
            raise ConfigError("at_s", [f"{at_s!r}: {passed}; expected an instant from there on"])
        self._executive.plan(at, port, value)

    def listen(self, port: OutPort[T], listener: Listener[T]) -> Listening:
        """Call `listener(at, value)`, `at` in ns, for all that leaves a port of any model.

        What is returned ends it.
        """
        return self._executive.simulator.listen(port, listener)

    def port(self, path: str) -> PortValues[Any]:
        """Return what passes a port, by its path: `controller.yaw.command_n`.

        Of an output port of any model, or an input port of the whole, from now on; of a run that is
        recorded also what has passed before. Asked for again, it is the same. Raises UnknownName
        for a port that there is not.
        """
        if path not in self._watched:
            root = self._executive.simulator.root
            known: dict[str, InPort[object] | OutPort[object]] = {
                **root.in_ports,
                **ports_below(root),
            }
            if path not in known:
                raise UnknownName.of("port", path, known)
            self._watched[path] = self._watch(path, known[path])
        return self._watched[path]

    def close(self) -> RunResult | None:
        """End the run in order; None if it never began or is over. Closing twice is harmless.

        Raises ModelError if a model's exit failed.
        """
        self._is_closed = True
        outcome = self._end()
        if self.dover is not None:
            self.dover.close()
        if outcome is None:
            return None
        self._raise_what_failed(outcome)
        return self._result(outcome)

    # ---------------------------------------------------------------------------------------------

    def _watch(self, path: str, port: InPort[T] | OutPort[T]) -> PortValues[T]:
        """What passes a port from now on."""
        so_far = self._passed_so_far(path)
        since = self._executive.reached if so_far is None else 0
        values = PortValues[T](path, port.type.__name__, so_far or (), since)
        self._executive.simulator.listen(port, values.take)
        return values

    def _passed_so_far(self, path: str) -> Iterable[tuple[int, Any]] | None:  # noqa: ARG002
        """What passed a port until now; None where that is not known."""
        return None

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Refuse a run from within a run, as by a listener or another thread."""
        if not self._running.acquire(blocking=False):
            raise RuntimeError("the run is under way; expected one that stands still")
        try:
            yield
        finally:
            self._running.release()

    def _run_to(self, until: int) -> Outcome:
        return self._executive.run_on(until)

    def _end(self) -> Outcome | None:
        return self._executive.end()

    def _raise_what_failed(self, outcome: Outcome) -> None:
        """Raise the error of a run that has ended by one, or could not be ended in order."""
        if outcome.error is not None:
            for fault in outcome.faults:
                outcome.error.add_note(fault)
            raise outcome.error
        if outcome.faults:
            raise self._failure("; ".join(outcome.faults))

    def _failure(self, faults: str) -> FirmwareRuntimeError:
        """Return the error of a run that could not be ended in order."""
        return ModelError(faults)

    def _result(self, outcome: Outcome) -> RunResult:
        reached = self._executive.reached
        at = min(reached, self._until) if outcome.state is RunState.ENDED else reached
        return RunResult(outcome.state, outcome.reason, at, self.statistics)


@contextmanager
def _signals_taken(executive: Executive) -> Iterator[list[str]]:
    """Within the block, signals end the run; yields the names of those that came."""
    taken: list[str] = []
    if threading.current_thread() is not threading.main_thread():
        yield taken
        return

    def take(name: str) -> None:
        taken.append(name)
        executive.request_stop(name)

    is_driving = executive.clock.speed != 0
    with stop_on_signals(take, give_up=executive.give_up, is_driving=is_driving):
        yield taken


def _raise_for(name: str) -> NoReturn:
    """Raise what a program gets that this signal ends."""
    if name == "SIGINT":
        raise KeyboardInterrupt
    raise SystemExit(_BY_SIGNAL + signal_number(name))
