"""A run of one end, tied to the run of the other: what the link means to arming and to the end."""

from collections.abc import Callable
from dataclasses import dataclass

from firmware_runtime.board.ends import BoardEnd
from firmware_runtime.board.registry import Board
from firmware_runtime.devs.part import Part
from firmware_runtime.devs.time import seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.executive.loop import Executive
from firmware_runtime.links.address import End, OpenChannel
from firmware_runtime.links.cut import cut_of
from firmware_runtime.links.link import Link, Terms


def check_end(end: BoardEnd | None, link: OpenChannel | None, clock: Clock) -> None:
    """Refuse what cannot be run. Raises ConfigError."""
    faults = []
    if link is not None and end is None:
        faults.append("--link without --role; expected the role that this end plays")
    if link is not None and not (isinstance(clock, MonotonicClock) and clock.speed == 1):
        faults.append("a link lives in real time; expected clock monotonic")
    if end is not None and end.has_hardware and link is None:
        fault = f"role {end.role} has the hardware, and drives nothing without a controller"
        faults.append(f"{fault}; expected --link")
    if faults:
        raise ConfigError("run", faults)


@dataclass(frozen=True, slots=True)
class LinkedPart:
    """The part of a board's model that one end runs, in the executive's loop."""

    board: Board
    end: BoardEnd
    part: Part
    executive: Executive


def open_link(linked: LinkedPart, open_channel: OpenChannel, log: Callable[[str], None]) -> Link:
    """The link of this end, in its loop. Raises ConfigError where it cannot be had.

    Ports at which a rig's own components hang are not part of the cut: the other end has no rig.
    """
    board, end, part, executive = linked.board, linked.end, linked.part, linked.executive
    stated = board.settings.link
    cut = cut_of(part, end.crossings, stated.limits)
    terms = Terms(
        timeout=seconds(stated.timeout_s),
        good=seconds(stated.good_s),
        keep=stated.keep,
        retain=frozenset(stated.retain),
    )
    channel = open_channel(End(end.role, end.has_hardware, terms.timeout))
    link = Link(
        executive,
        cut,
        part.entering,
        channel,
        terms,
        board=board.name,
        role=end.role,
        takes_old=not end.has_hardware,
        log=log,
    )
    for crossing in cut.leaving:
        executive.simulator.listen(part.leaving[crossing.name], link.leaves(crossing))
    return link
