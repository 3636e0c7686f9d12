"""A UDP path with an impairment, as a process of its own: what `tc netem` does, without the kernel.

    controller <--> front socket of this process, back socket <--> robot

The impairment is what `--impair` says, each way the same, so out and back takes twice the delay:

    delay=40ms,jitter=10ms,loss=2%,reorder=1%,duplicate=0.5%,seed=1

Jitter is uniform about the delay, so datagrams that follow each other closely may change places;
one that is reordered is sent at once. What happens to the n-th datagram of a way depends on the
seed, the way and n alone. A datagram that comes in at one socket leaves by the other, late, twice
or not at all, as `Decisions` says. The robot's address is given; the controller is at the address
that spoke last.

The process prints a JSON line with its addresses, works until its standard input ends or a signal
comes, and prints what it has counted.
"""

import json
import re
import socket
import sys
from dataclasses import asdict, dataclass, fields
from heapq import heappop, heappush
from random import Random
from select import select
from time import monotonic_ns
from typing import Any, Final, Literal, TypeAlias

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError, suggested
from firmware_runtime.links.endpoint import Endpoint, bound, datagrams, endpoint, written
from firmware_runtime.system.signals import until_signal

LARGEST: Final = 1 << 16
MOST_WAITING: Final = 10_000
POLL_S: Final = 1.0


Way: TypeAlias = Literal["out", "back"]
"""Out: from the controller to the robot."""
OPTION: Final = "--impair"
_UNITS: Final = {"us": MICROSECOND, "ms": MILLISECOND, "s": SECOND}
_LONGEST: Final = 10 * SECOND
_HIGHEST_SEED: Final = (1 << 53) - 1
_NUMBER: Final = r"([0-9]+\.?[0-9]*(?:e[+-]?[0-9]+)?|\.[0-9]+)"


@dataclass(frozen=True, slots=True)
class Impairment:
    """Impairment of a path: spans in ns, the others as shares of all datagrams."""

    delay: int = 0
    jitter: int = 0
    loss: float = 0.0
    reorder: float = 0.0
    duplicate: float = 0.0
    seed: int = 1

    def __str__(self) -> str:
        """Write it as the option has it, without what is zero."""
        words = [
            f"{name}={span / MILLISECOND:g}ms"
            for name, span in (("delay", self.delay), ("jitter", self.jitter))
            if span > 0
        ]
        words += [
            f"{name}={share * 100:g}%"
            for name in ("loss", "reorder", "duplicate")
            if (share := getattr(self, name)) > 0
        ]
        return ",".join([*words, f"seed={self.seed}"])


def impairment(text: str) -> Impairment:
    """Read the option. Raises ConfigError with every fault in it."""
    faults: list[str] = []
    values: dict[str, Any] = {}
    for word in filter(None, text.split(",")):
        name, _, value = word.partition("=")
        if name in values:
            faults.append(f"{name}: given twice; expected it once")
        try:
            values[name] = _value(name, value)
        except ValueError as error:
            faults.append(str(error))
    if not values and not faults:
        faults.append(f"{text!r}: expected some of {', '.join(_NAMES)}")
    if values.get("jitter", 0) > values.get("delay", 0):
        faults.append("jitter: more than the delay; expected as much at most")
    if faults:
        raise ConfigError(OPTION, faults)
    return Impairment(**values)


_NAMES: Final = [field.name for field in fields(Impairment)]


class Decisions:
    """Decides what happens to the datagrams of one way, one after the other."""

    def __init__(self, impairment: Impairment, way: Way) -> None:
        self._impairment = impairment
        self._random = Random(f"{impairment.seed} {way}")  # noqa: S311 -- repeatable, no secret

    def next(self) -> tuple[int, ...]:
        """The next datagram's delay, ns: none where it is lost, two where there are two of it."""
        how = self._impairment
        lost, at_once, twice, first, second = (self._random.random() for _ in range(5))
        if lost < how.loss:
            return ()
        delay = 0 if at_once < how.reorder else self._delay(first)
        return (delay, self._delay(second)) if twice < how.duplicate else (delay,)

    def _delay(self, drawn: float) -> int:
        how = self._impairment
        return how.delay + round((2 * drawn - 1) * how.jitter)


def _value(name: str, text: str) -> float:
    """Return one value, in ns, as a share, or the seed. Raises ValueError, with the fault."""
    if name in {"delay", "jitter"}:
        found = re.fullmatch(rf"{_NUMBER}(us|ms|s)", text)
        if found and (span := round(float(found[1]) * _UNITS[found[2]])) <= _LONGEST:
            return span
        raise ValueError(f"{name}: {text!r}: expected a span such as 80ms, 10s at most")
    if name in {"loss", "reorder", "duplicate"}:
        found = re.fullmatch(rf"{_NUMBER}%", text)
        if found and (share := float(found[1]) / 100) <= 1:
            return share
        raise ValueError(f"{name}: {text!r}: expected a share such as 2%")
    if name == "seed":
        if re.fullmatch("[0-9]+", text) and int(text) <= _HIGHEST_SEED:
            return int(text)
        raise ValueError(f"seed: {text!r}: expected a whole number below 2^53")
    expected = suggested(name, _NAMES, f"expected some of {', '.join(_NAMES)}")
    raise ValueError(f"{name!r}: {expected}")


@dataclass(slots=True)
class Counts:
    """Datagrams of one way."""

    received: int = 0
    lost: int = 0
    """Dropped by decision."""
    duplicated: int = 0
    sent: int = 0
    not_sent: int = 0
    """Those that found no room here, no address yet, or that the kernel refused."""


class OneWay:
    """Datagrams that come in at one socket and leave by the other when they are due."""

    def __init__(self, impairment: Impairment, way: Way, to: socket.socket) -> None:
        self.counts = Counts()
        self.address: tuple[Any, ...] | None = None
        """Where they go."""
        self._decisions = Decisions(impairment, way)
        self._to = to
        self._waiting: list[tuple[int, int, bytes]] = []

    @property
    def due_at(self) -> int | None:
        """Instant at which the next one is to be sent, ns; None if none waits."""
        return self._waiting[0][0] if self._waiting else None

    def take(self, datagram: bytes, now: int) -> None:
        """Decide what happens to one that came in."""
        counts = self.counts
        counts.received += 1
        delays = self._decisions.next()
        counts.lost += not delays
        counts.duplicated += len(delays) > 1
        for delay in delays:
            if len(self._waiting) < MOST_WAITING:
                heappush(self._waiting, (now + delay, counts.received, datagram))
            else:
                counts.not_sent += 1

    def send_due(self, now: int) -> None:
        """Send all whose time has come."""
        while self._waiting and self._waiting[0][0] <= now:
            _, _, datagram = heappop(self._waiting)
            if self._is_sent(datagram):
                self.counts.sent += 1
            else:
                self.counts.not_sent += 1

    def _is_sent(self, datagram: bytes) -> bool:
        if self.address is None:
            return False
        try:
            self._to.sendto(datagram, self.address)
        except OSError:  # no room, or no way there
            return False
        return True


class ImpairedPath:
    """Both ways between two sockets that are bound already; it closes them."""

    def __init__(
        self, front: socket.socket, back: socket.socket, robot: Endpoint, how: Impairment
    ) -> None:
        self._front, self._back = front, back
        self._out = OneWay(how, "out", back)
        self._return = OneWay(how, "back", front)
        self._out.address = robot.where

    @property
    def addresses(self) -> dict[str, str]:
        """Addresses of both sockets, with the ports that the kernel chose."""
        ends = {"front": self._front, "back": self._back}
        return {name: written(end.getsockname()) for name, end in ends.items()}

    @property
    def counts(self) -> dict[str, dict[str, int]]:
        """Counters of the datagrams, by way."""
        return {"out": asdict(self._out.counts), "back": asdict(self._return.counts)}

    def work(self, *wake_up: Any) -> list[Any]:  # noqa: ANN401 -- whatever has a descriptor
        """Carry what there is; return which of the others is readable, after a second at most."""
        now = monotonic_ns()
        due = [at for way in (self._out, self._return) if (at := way.due_at) is not None]
        timeout_s = min([POLL_S, *(max(at - now, 0) / SECOND for at in due)])
        ready, _, _ = select([self._front, self._back, *wake_up], (), (), timeout_s)
        now = monotonic_ns()
        if self._front in ready:
            self._receive(self._front, self._out, self._return, now)
        if self._back in ready:
            self._receive(self._back, self._return, None, now)
        self._out.send_due(now)
        self._return.send_due(now)
        return [each for each in ready if each in wake_up]

    def close(self) -> None:
        """Close the sockets."""
        self._front.close()
        self._back.close()

    def _receive(self, at: socket.socket, way: OneWay, answers: OneWay | None, now: int) -> None:
        """Take what has come; `answers` learn where it came from."""
        for datagram, address in datagrams(at, LARGEST):
            if answers is not None:
                answers.address = address
            way.take(datagram, now)


def main(arguments: list[str]) -> int:
    """`FRONT BACK ROBOT IMPAIRMENT`: carry until standard input ends or a signal comes."""
    front_at, back_at, robot = (endpoint("impairment", text) for text in arguments[:3])
    front, back = (bound("impairment", at) for at in (front_at, back_at))
    path = ImpairedPath(front, back, robot, impairment(arguments[3]))
    with until_signal() as signalled:
        _print(path.addresses)
        is_over = False
        while not is_over:
            is_over = bool(path.work(signalled, sys.stdin))
    path.close()
    _print(path.counts)
    return 0


def _print(what: object) -> None:
    sys.stdout.write(f"{json.dumps(what)}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
