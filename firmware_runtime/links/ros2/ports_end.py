"""Ports of the run, read by a thread of the node; and values for its input ports.

    the run's socket --> watched ports, its time, its refusals --> publish
    subscriptions --> values --> the run's socket

rclpy waits for no descriptor of ours, hence the thread. It asks for the ports again every few
seconds, as every watcher does. Values go to one run: a command for a robot that has gone must not
move the one that is started in its place.
"""

import json
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from selectors import EVENT_READ, DefaultSelector
from socket import socketpair
from threading import Thread
from time import monotonic_ns, time_ns
from typing import Final, Generic, TypeVar

import msgspec

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.links.ports.datagrams import LONGEST, MOST_PORTS, RENEW_EVERY, message_of
from firmware_runtime.links.ports.robot_end import OneRunsEnd, RobotEnd

TIME_EVERY: Final = SECOND

_decode = msgspec.json.Decoder().decode


class PortsEnd:
    """Reads until it is closed; `receive` is called in its thread with port, stamp and value.

    `late` is called when `due_at` has come. `log` takes a sentence.
    """

    def __init__(
        self,
        statistics: Path,
        ports: Sequence[str],
        receive: Callable[[str, int, object], None],
        log: Callable[[str], None],
    ) -> None:
        self.counts: Counter[str] = Counter()
        """Messages received, values sent, refused and dropped, and what could not be read."""
        self.stamps = Stamps()
        self._receive = receive
        self._log_once = SaidOnce(log)
        self._requests = list(_requests(ports))
        self._ends = [RobotEnd(statistics) for _ in self._requests]
        self._time = RobotEnd(statistics)
        self._values = OneRunsEnd(statistics)
        self._all = (*self._ends, self._time, self._values)
        self._wake, self._woken = socketpair()
        self._is_open = True
        self._watch_at = self._time_at = 0
        self._thread = Thread(target=self._read, name="ports", daemon=True)

    def begin(self, late: Callable[[int], int]) -> None:
        """Start reading; `late` publishes what is due and says when something is due again."""
        self._late = late
        self._thread.start()

    def send(self, port: str, value: object) -> bool:
        """Put a value into an input port of the run; whether there was a run and room for it."""
        try:
            self._values.send(message_of(port=port, value=value))
        except OSError:
            self.counts["dropped"] += 1
            return False
        self.counts["sent"] += 1
        return True

    def refuse(self, sentence: str) -> None:
        """Count a value that was refused, by the run or before; log the sentence once."""
        self.counts["refused"] += 1
        self._log_once(f"refused: {sentence}")

    def close(self) -> None:
        """Stop reading."""
        self._is_open = False
        self._wake.send(b".")
        self._thread.join()
        for end in self._all:
            end.close()
        self._wake.close()
        self._woken.close()

    # The thread -----------------------------------------------------------------------------------

    def _read(self) -> None:
        with DefaultSelector() as selector:
            selector.register(self._woken, EVENT_READ)
            for end in self._all:
                selector.register(end, EVENT_READ, end)
            while self._is_open:
                due_at = min(self._ask(monotonic_ns()), self._late(monotonic_ns()))
                for key, _ in selector.select(max(0, due_at - monotonic_ns()) / SECOND):
                    for datagram in key.data.received() if key.data is not None else ():
                        self._take_what_is_understood(datagram)

    def _ask(self, now: int) -> int:
        """Ask for the run's time and its ports again, when it is due; say when it is next."""
        if now >= self._time_at:
            self._time_at = now + TIME_EVERY
            self._say(self._time, b'{"time": true}')
        if now >= self._watch_at and self.stamps.is_known:
            self._watch_at = now + RENEW_EVERY
            for end, request in zip(self._ends, self._requests, strict=True):
                self._say(end, request)
        return min(self._time_at, self._watch_at if self.stamps.is_known else NEVER)

    def _say(self, end: RobotEnd, request: bytes) -> None:
        try:
            end.send(request)
        except BlockingIOError:  # the run has no time now; it is asked again
            pass
        except OSError:
            self.stamps.forget()
            self._watch_at = 0

    def _take_what_is_understood(self, datagram: bytes) -> None:
        try:
            self._take(datagram)
        except Exception as error:  # noqa: BLE001 -- of any program that is no run
            self.counts["failed"] += 1
            self._log_once(f"not understood: {type(error).__name__}: {error}")

    def _take(self, datagram: bytes) -> None:
        said = _decode(datagram)
        if "port" in said:
            self.counts["received"] += 1
            if self.stamps.is_known:
                self._receive(said["port"], said["t_ns"], said["value"])
        elif "monotonic_ns" in said:
            to_system = time_ns() - monotonic_ns()
            if not self.stamps.measure(said["t_ns"], said["monotonic_ns"], to_system):
                self._watch_at = 0
        elif "error" in said:
            self.refuse(said["error"])


def _requests(ports: Sequence[str]) -> Iterator[bytes]:
    """The datagrams that watch all of these ports, as few as can be."""
    some: list[str] = []
    for port in dict.fromkeys(ports):
        if len(some) == MOST_PORTS or len(_watch([*some, port])) > LONGEST:
            yield _watch(some)
            some = []
        some.append(port)
    if some:
        yield _watch(some)


def _watch(ports: Sequence[str]) -> bytes:
    return json.dumps({"watch": ports}).encode()


MOST: Final = 64
"""Different sentences."""


class SaidOnce:
    """Passes each sentence on to `log` the first time, as long as there are not too many."""

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log = log
        self._said: set[str] = set()

    def __call__(self, sentence: str) -> None:
        """Say it, unless it was said."""
        if sentence not in self._said and len(self._said) < MOST:
            self._said.add(sentence)
            self._log(sentence)


CLOCK_SET: int = SECOND
"""A stamp that would go back further than this follows: the system's clock was set."""
_NEARLY = 0.01


class Stamps:
    """Turns instants of one run into ns since 1970; `measure` is repeated once a second.

    In scaled time the pace of the run is found from two measurements.
    """

    def __init__(self) -> None:
        self._t_ns = self._monotonic_ns = self._to_system = 0
        self._pace = 1.0
        self._last: dict[str, int] = {}
        self._is_measured = False

    @property
    def is_known(self) -> bool:
        """Return whether a run has said its time."""
        return self._is_measured

    def measure(self, t_ns: int, monotonic_ns: int, to_system: int) -> bool:
        """Take an instant of the run and of the monotonic clock, and what leads to system time.

        Return whether it is the run that was measured before.
        """
        since = t_ns - self._t_ns
        is_same = self._is_measured and since > 0
        if is_same:
            pace = (monotonic_ns - self._monotonic_ns) / since
            self._pace = 1.0 if abs(pace - 1.0) < _NEARLY else pace
        else:
            self._pace = 1.0
        self._t_ns, self._monotonic_ns, self._to_system = t_ns, monotonic_ns, to_system
        self._is_measured = True
        return is_same

    def forget(self) -> None:
        """The run is gone; the next has another beginning."""
        self._is_measured = False

    def of(self, topic: str, t_ns: int) -> int:
        """The stamp of a message of the run; a topic's stamps never go back."""
        passed = round((t_ns - self._t_ns) * self._pace)
        stamp = self._monotonic_ns + passed + self._to_system
        last = self._last.get(topic, stamp)
        if last - CLOCK_SET < stamp < last:
            stamp = last
        self._last[topic] = stamp
        return stamp


M = TypeVar("M")


class Pace(Generic[M]):
    """Lets so many messages a second through at most, and keeps the newest of those left out.

    By the instants of the run, which have no jitter: of samples at 100 Hz every second goes out at
    50 Hz, as soon as it comes. One that came too early goes all the same where no other follows it:
    the last command, the last reading.

    `due_at` is when the one that is kept is to go, in ns of the caller's clock. With a rate of 0
    none is kept.
    """

    def __init__(self, rate_hz: float) -> None:
        self.period = round(SECOND / rate_hz) if rate_hz > 0 else 0
        self.due_at = NEVER
        self._next_t = 0
        self._kept: M | None = None

    def take(self, message: M, t_ns: int, now: int) -> M | None:
        """The message of the instant `t_ns`, if one is due; else it is kept, not the one before."""
        early = self._next_t - t_ns
        if not 0 < early <= self.period:  # a run that begins again is far too early
            on_grid = self._next_t + self.period
            self._next_t = on_grid if t_ns < on_grid <= t_ns + self.period else t_ns + self.period
            self._kept, self.due_at = None, NEVER
            return message
        self._kept = message
        self.due_at = now + early + self.period
        return None

    def late(self, now: int) -> M | None:
        """The message that was kept, if no other came in its time."""
        if now < self.due_at:
            return None
        kept, self._kept, self.due_at = self._kept, None, NEVER
        return kept
