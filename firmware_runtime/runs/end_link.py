"""A run of one end, tied to the run of the other: what the link means to arming and to the end.

Outputs go off while the link is bad, and are driven again once it has been good for a while. When
the task of one end is over, both end; an end that was stopped is waited for.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING

from firmware_runtime.board.ends import BoardEnd
from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Ending
from firmware_runtime.devs.part import Part
from firmware_runtime.devs.ports import AnyPort
from firmware_runtime.devs.time import seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.system.this_process import kept_off

if TYPE_CHECKING:
    from firmware_runtime.links.cut.address import OpenChannel
    from firmware_runtime.links.cut.link import Link
    from firmware_runtime.links.cut.refusal import Reason
    from firmware_runtime.links.cut.wire import Farewell

_UNANSWERED = (
    "expected an end that is there, with the same key if there is one: what another key has signed "
    "is counted there, and not answered"
)
_FORGED = "signed with another key, or from another address; expected the same key at both ends"


def check_end(end: BoardEnd | None, link: "OpenChannel | None", clock: Clock) -> None:
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


def idle_options(end: BoardEnd | None, **given: object) -> list[str]:
    """Options that have no effect at an end without hardware, a sentence each."""
    if end is None or end.has_hardware:
        return []
    return [
        f"{name}: role {end.role} has no hardware: leave it out"
        for name, value in given.items()
        if value is not False
    ]


class LinkedEnd:
    """The link of a run; `end_with` is called when the other end says that the task is over.

    `ends_both`: when the time of this end is up, the other ends too. `turn_off` is called with
    a reason when the link turns bad.
    """

    def __init__(
        self,
        link: "Link",
        executive: Executive,
        end_with: Callable[[Ending], None],
        turn_off: Callable[[str], None],
        *,
        ends_both: bool,
    ) -> None:
        self.link = link
        self.path = "link"
        self.ends_both = ends_both
        self._end_with = end_with
        self._other_end_is_over = False
        executive.readiness.require(self)
        self.link.on_bad = turn_off
        self.link.on_bye = self._end_too
        self.link.on_closed = partial(
            executive.request_stop, "the carrier of the link has ended", RunState.FAILED
        )

    def unready(self) -> str | None:
        """Return why this end has controlled nothing."""
        if self.link.peer.greeting is not None:
            return None
        if self.link.peer.is_taken:
            return "has met an end only that has another peer"
        refused = {reason: count for reason, count in self.link.counts.refused.items() if count > 0}
        return f"has met no other end{_came(refused)}"

    def say_goodbye(self, outcome: Outcome, ending: Ending | None) -> None:
        """The run is over: let the other end know why, unless it said so itself."""
        if not self._other_end_is_over:
            is_done = self.ends_both and outcome.state is RunState.ENDED
            failed = ending is not None and ending.failed
            is_over = ending is not None or is_done
            self.link.say_goodbye(outcome.reason, is_over=is_over, failed=failed)

    def _end_too(self, farewell: "Farewell") -> None:
        if farewell.is_over and not self._other_end_is_over:
            self._other_end_is_over = True
            self._end_with(Ending(farewell.reason, farewell.failed))


def _came(refused: "Mapping[Reason, int]") -> str:
    """Return what came and was refused; where nothing came, what may be the reason."""
    if not refused:
        return f": nothing came; {_UNANSWERED}"
    total = sum(refused.values())
    counts = ", ".join(f"{reason} {count}" for reason, count in refused.items())
    if len(refused) == 1 and "forged" in refused:
        return f": {total} datagrams came, and none was authentic: {_FORGED}"
    return f": {total} datagrams came, and all were refused ({counts})"


def _applied_ports(part: Part) -> list[str]:
    """The ports that say what actuators apply: sent once, and an end that comes later needs it."""
    from firmware_runtime.models.motion import Applied  # noqa: PLC0415 -- runs with a link only

    ports: dict[str, AnyPort] = {**part.leaving, **part.entering}
    return [name for name, port in ports.items() if port.type is Applied]


def open_link(  # noqa: PLR0913 -- put together once, by the start
    board: Board,
    end: BoardEnd,
    part: Part,
    executive: Executive,
    open_channel: "OpenChannel",
    *,
    log: Callable[[str], None],
) -> "Link":
    """Open the link of an end, in its loop. Raises ConfigError where it cannot be had.

    Ports at which a rig's own components hang are not part of the cut: the other end has no rig.
    """
    from firmware_runtime.links.cut.address import End  # noqa: PLC0415
    from firmware_runtime.links.cut.cut import Terms, cut_of  # noqa: PLC0415
    from firmware_runtime.links.cut.link import Link  # noqa: PLC0415

    stated = board.settings.link
    cut = cut_of(part, end.crossings, stated.limits, stated.ordered)
    terms = Terms(
        timeout=seconds(stated.timeout_s),
        good=seconds(stated.good_s),
        keep=stated.keep,
        retain=frozenset((*stated.retain, *_applied_ports(part))),
        ordered=frozenset(stated.ordered),
    )
    with kept_off(board.settings.executive.cpus):
        channel = open_channel(End(board.name, end.role, end.has_hardware))
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
