"""The run, as its node speaks with it: by its socket. No wait is longer than TIMEOUT_S.

The sign of life (`tend`) waits for nothing: it sends one request and reads what has been answered
since the last.
"""

import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic_ns
from typing import Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ControlError
from firmware_runtime.links.control import Answer, ask, post
from firmware_runtime.links.ports.datagrams import message_of
from firmware_runtime.links.ports.robot_end import RobotEnd

TIMEOUT_S: Final = 1.0
"""How long the node waits for an answer; meanwhile it does nothing else."""
SILENCE: Final = 2 * SECOND
"""A run that has not answered for so long is taken to be gone, ns."""


@dataclass(slots=True)
class Seen:
    """State of a run, as it has said."""

    run: str
    """Its own name: another run has another one."""
    armed: bool
    reason: str
    """Why it is not armed."""
    revision: int
    """Counts the changes of its settings."""


class RunEnd:
    """The node's end of the run's socket; speaks with this run, and with the next."""

    def __init__(self, statistics: Path) -> None:
        self.statistics = statistics
        self.seen: Seen | None = None
        """What is known of a run that is there."""
        self.why_gone = "no run was looked for yet"
        self.lease: str | None = None
        """The lease that keeps the robot armed."""
        self.has_lost_lease = False
        self._end = RobotEnd(statistics)
        self._received_at = self._sent_at = monotonic_ns()
        self._lease_ns = self._held_until = 0

    def ask(self, request: str, **more: object) -> Answer:
        """The answer to a request, which has no effect later. Raises ControlError without one."""
        return ask(self.statistics, request, TIMEOUT_S, **more)

    def find(self) -> Seen:
        """Wait for what a run says of itself. Raises ControlError without one."""
        return self._note(self.ask("state"), monotonic_ns())

    def arm(self, lease_s: float) -> list[str]:
        """Arm, for as long as `tend` goes on; return why it is refused.

        Raises ControlError without an answer: then the run is asked to disarm, as it may arm yet.
        """
        self._sent_at, self._lease_ns = monotonic_ns(), round(lease_s * SECOND)
        try:
            answer = self.ask("arm", lease_s=lease_s)
        except ControlError:
            post(self.statistics, "disarm")
            raise
        self.lease, self.has_lost_lease = answer.get("lease"), False
        self._held_until = self._sent_at + self._lease_ns
        return list(answer["refused"])

    def disarm(self) -> Answer:
        """Disarm, also if the run comes to it late. Raises ControlError without an answer."""
        self.lease = None
        return ask(self.statistics, "disarm", TIMEOUT_S)

    @property
    def has_lost_robot(self) -> bool:
        """True if a robot that was armed here is disarmed; without a lease, by what is known."""
        if self.lease is not None:
            return self.has_lost_lease
        return self.seen is not None and not self.seen.armed

    @property
    def holds_robot(self) -> bool:
        """True if this node is certain to have the robot armed; without a lease it always is.

        Not so after a standstill of this process: the lease may have run out, and another may have
        armed the robot since.
        """
        return self.lease is None or monotonic_ns() <= self._held_until

    def tend(self) -> None:
        """Take in what the run has said, and give a sign of life."""
        now = monotonic_ns()
        for datagram in self._end.received():
            self._take(datagram, now)
        said = {"request": "state"} if self.lease is None else _renewal(self.lease)
        self._sent_at = now
        try:
            self._end.send(message_of(**said))
        except BlockingIOError:
            pass
        except OSError as error:
            self._gone(f"no run listens ({error.strerror})")
        if self._end.why_not_believed:
            self._gone(self._end.why_not_believed)
        if self.seen is not None and now - self._received_at > SILENCE:
            self._gone(f"the run has not answered for {SILENCE // SECOND} s")

    def close(self) -> None:
        """Close the socket."""
        self._end.close()

    def _take(self, datagram: bytes, now: int) -> None:
        with suppress(KeyError, TypeError, ValueError, RecursionError):  # a refusal, or no run's
            answer = json.loads(datagram)
            self._note(answer, now)
            if self.lease is not None and answer.get("lease") == self.lease:
                self.has_lost_lease = not (answer["leased"] and answer["armed"])
                if not self.has_lost_lease:  # as of when it was asked, which is the time before
                    self._held_until = self._sent_at + self._lease_ns

    def _note(self, answer: Answer, now: int) -> Seen:
        self.seen = Seen(answer["run"], answer["armed"], answer["reason"] or "", answer["revision"])
        self._received_at = now
        return self.seen

    def _gone(self, why: str) -> None:
        self.seen = None
        self.why_gone = why


def _renewal(lease: str) -> dict[str, str]:
    return {"request": "renew", "lease": lease}
