"""A run's end of a link in this process, on a clock of the test's own; what it sends is taken."""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.part import Part, part_of
from firmware_runtime.executive.clocks import Clock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.cut.channel import Channel
from firmware_runtime.links.cut.cut import Limits, Terms, cut_of
from firmware_runtime.links.cut.link import Link


class Way(Channel):
    """A way in this process: what the link sends is handed on, what it is to get is in `waits`."""

    def __init__(self, hand_on: Callable[[bytes], None]) -> None:
        self.waits: deque[bytes] = deque()
        self._hand_on = hand_on

    def fileno(self) -> int:
        raise AssertionError("nothing waits here")

    def receive(self) -> bytes | None:
        return self.waits.popleft() if self.waits else None

    def send(self, frame: bytes) -> None:
        self._hand_on(frame)

    def linger(self) -> None:
        """Every send finds room here."""

    def close(self) -> None:
        """There is no socket."""


def role_of(ports: Mapping[str, type[Any]], role: str) -> Part:
    """Return a part of a model of two: each `part.port` is an output there, an input of the other.

    The parts do nothing.
    """
    whole = Coupled("rover")
    parts = {
        name: whole.add(Atomic(name)) for name in sorted({each.split(".")[0] for each in ports})
    }
    for path, kind in ports.items():
        name, _, port = path.partition(".")
        (other,) = parts.keys() - {name}
        whole.couple(parts[name].out_port(port, kind), parts[other].in_port(port, kind))
    return part_of(whole, [role])


def link_of(
    part: Part,
    channel: Channel,
    terms: Terms,
    now: Callable[[], int],
    *,
    limits: dict[str, Limits] | None = None,
    takes_old: bool = False,
    clock: Clock | None = None,
    log: Callable[[str], None] = lambda _: None,
) -> Link:
    """Return the end of a part, all whose ports cross the cut."""
    configuration = Configuration(has_link=True)
    return Link(
        Executive(part.model, clock or VirtualClock(), configuration=configuration),
        cut_of(part, [*part.entering, *part.leaving], limits, terms.ordered),
        part.entering,
        channel,
        terms,
        board="rover",
        role="robot",
        takes_old=takes_old,
        log=log,
        time=now,
    )
