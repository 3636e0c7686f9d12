"""The ports socket: values into a running model, and what its ports send, for other processes.

A Unix datagram socket beside the statistics (`BOARD.ports`), for every process that may write to
it; what may be said is in `datagrams`. To the loop it is a source: a value enters the model as an
external event of the next pass, like any other input. Input ports of the top model are all that can
be written.

It costs the loop little, and never more than a bounded amount:

- datagrams are read between two steps, `AT_ONCE` a pass at most, the others wait in the kernel;
- a port that is watched costs the step one append a message, any other nothing (`ports.Taps`);
- everything that is sent, answers too, is sent after the step, while there is time left until the
  next event; a loop that is late sends nothing;
- nothing waits: what finds no room, here or at a reader, is dropped and counted.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from time import monotonic_ns
from typing import Any, Final

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import MICROSECOND, SECOND
from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.age import BESIDE, age_of, note_ages
from firmware_runtime.links.ports.datagrams import (
    LONGEST,
    TIMEOUT,
    Put,
    Refusal,
    Request,
    Time,
    Watch,
    message_of,
    understood,
)
from firmware_runtime.links.ports.ports import Ports, Taps
from firmware_runtime.links.ports.watchers import (
    WATCHED_FOR,
    Address,
    SocketOutlet,
    Watchers,
    send_once,
)
from firmware_runtime.links.socket_file import SocketFile

AT_ONCE: Final = 8
"""How many datagrams are read in one pass of the loop."""
ROOM: Final = 64
"""How many answers may wait to be sent."""
RESERVE: Final = 200 * MICROSECOND
"""Nothing more is sent when the next event is as near as this, ns."""


@dataclass(slots=True)
class Counts:
    """Datagrams since the start of the run."""

    received: int = 0
    refused: int = 0
    sent: int = 0
    dropped: int = 0
    """Messages and answers that found no room, here or where they were to go."""


class PortsSocket:
    """A source of the executive's loop and a hook of its run, for these ports of its model.

    Its mode is 0660 less the umask: never open to all. `now` is any clock in ns that does not
    stand still. Raises ConfigError if the socket cannot be made.
    """

    def __init__(
        self, path: Path, ports: Ports, executive: Executive, now: Callable[[], int] = monotonic_ns
    ) -> None:
        self._counts = Counts()
        self._ports = ports
        self._watchers = Watchers(now, SocketOutlet)
        self._listing = self._ports.listing()
        self._answers: deque[tuple[dict[str, object], Address]] = deque()
        self._taps = Taps(executive.simulator)
        self._run_now = executive.clock.now
        self._file = SocketFile(path)
        self._socket = self._file.socket
        note_ages(self._socket)
        executive.add_source(self)
        executive.hooks.append(self)

    def close(self) -> None:
        """Stop listening, and remove the socket."""
        self._watchers.close()
        self._file.close()

    # What the loop asks for -----------------------------------------------------------------------

    def fileno(self) -> int:
        """The descriptor that becomes readable when there is a datagram."""
        return self._socket.fileno()

    def receive(self) -> Sequence[tuple[InPort[Any], object]]:
        """The values that have come; note which ports each sender watches."""
        arrivals: list[tuple[InPort[Any], object]] = []
        for _ in range(AT_ONCE):
            try:
                datagram, beside, _, sender = self._socket.recvmsg(LONGEST + 1, BESIDE)
            except BlockingIOError:
                break
            self._counts.received += 1
            try:
                request = understood(datagram)
                if isinstance(request, Put):
                    _refuse_outdated(request.port, age_of(beside))
                    arrivals.append(self._ports.arrival(request.port, request.value))
                    if request.confirm:
                        self._answer(sender, taken=request.port)
                else:
                    self._obey(request, sender)
            except Refusal as why:
                self._counts.refused += 1
                self._answer(sender, error=str(why))
        return arrivals

    def between_steps(self, now: int, left: int) -> None:
        """Send what is to be sent, as far as there is time."""
        if self._watchers and self._watchers.forget_silent():
            self._open_taps()
        if self._answers or self._taps.sent:
            self._send_waiting(now + left - RESERVE)

    # ----------------------------------------------------------------------------------------------

    def _obey(self, request: Request, sender: Address | None) -> None:
        if sender is None:
            raise Refusal("no way to answer: the sender's socket has no address")
        if isinstance(request, Watch):
            self._ports.watched(request.watch)
            self._watchers.renew(sender, request.watch, request.every)
            self._open_taps()
            self._answer(sender, watching=request.watch, for_s=WATCHED_FOR // 10**9)
        elif isinstance(request, Time):
            self._answer(sender, t_ns=self._run_now(), monotonic_ns=monotonic_ns())
        else:
            self._answer(sender, ports=self._listing, counts=self.counts())

    def counts(self) -> dict[str, int]:
        """What became of all datagrams so far."""
        counts = asdict(self._counts)
        counts["dropped"] += self._taps.lost
        return counts

    def _open_taps(self) -> None:
        self._taps.open(self._ports.watched(self._watchers.ports))

    def _answer(self, sender: Address | None, **what: object) -> None:
        if sender is None:
            return
        if len(self._answers) < ROOM:
            self._answers.append((what, sender))
        else:
            self._counts.dropped += 1

    def _send_waiting(self, until: int) -> None:
        sent = self._taps.sent
        while self._run_now() < until:
            if self._answers:
                what, sender = self._answers.popleft()
                self._send(partial(send_once, address=sender), message_of(**what))
            elif sent:
                self._pass_on(*sent.popleft())
            else:
                return

    def _pass_on(self, path: str, at: int, value: object) -> None:
        watchers = self._watchers.of(path)
        if not watchers:
            return
        try:
            message = message_of(port=path, t_ns=at, value=value)
        except Exception:  # noqa: BLE001 -- a value without a form in JSON must not end the run
            self._counts.dropped += len(watchers)
            return
        for watcher in watchers:
            if not self._send(watcher.outlet.send, message):
                self._watchers.forget(watcher.address)
                self._open_taps()

    def _send(self, send: Callable[[bytes], None], message: bytes) -> bool:
        """Send and count it; whether there is a reader still."""
        try:
            send(message)
        except OSError as error:
            self._counts.dropped += 1
            return not isinstance(error, ConnectionError)
        self._counts.sent += 1
        return True


def _refuse_outdated(name: str, age: int) -> None:
    """Refuse a value that a run which stood still finds when it goes on. Raises Refusal."""
    if age > TIMEOUT:
        raise Refusal(
            f"{name}: sent {age / SECOND:.1f} s before it was read; expected a value that has not "
            f"waited for more than {TIMEOUT // SECOND} s"
        )
