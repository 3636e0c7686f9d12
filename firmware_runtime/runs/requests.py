"""Requests of other processes to a run, by its socket.

arm        arms, unless a pre-arm check fails; with `lease_s` only as long as it is renewed
disarm     makes outputs safe and keeps them so
renew      renews the `lease` of an `arm`
state      says whether it is armed, and why not
get        the gains and limits, by key
set        changes all that `values` names, or none
"""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from time import monotonic_ns
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.control import TIMEOUT_S, Answer, Request, refuse_more, why_late
from firmware_runtime.links.ports.ports import Ports
from firmware_runtime.links.ports.run_socket import RunSocket
from firmware_runtime.runs.arming import Arming
from firmware_runtime.runs.tuning import Tuning

ALWAYS_ARMED = (
    "this run has no outputs outside of itself, so there is nothing to disarm; on doubles of its "
    "own `run --supervised` arms and disarms"
)
_TAKEN_SINCE = "requested before the right to drive was taken; expected a request after that"
SLOW = {"arm": MILLISECOND // 2, "set": 5 * MILLISECOND}
"""Ns that a request may take, of those that would make a step late. All pre-arm checks take 0.2 to
0.4 ms on a PC, a setting, which is judged as a board's file is, 2.4 ms."""


class Requests:
    """A run's socket and what it answers; closes with the run.

    `arming` is None for a run that may always drive. `log` gets every change of a setting. `ports`
    are those that others may write and watch, None for none of them.
    """

    def __init__(  # noqa: PLR0913 -- put together once, by the session
        self,
        path: Path,
        executive: Executive,
        ports: Ports | None,
        *,
        arming: Arming | None,
        tuning: Tuning,
        log: Callable[[str], None],
    ) -> None:
        self._executive = executive
        self._arming = arming
        self._tuning = tuning
        self._log = log
        self._run = os.urandom(8).hex()
        answers = {
            "arm": self._arm,
            "disarm": self._disarm,
            "renew": self._renew,
            "state": self._state,
            "get": self._get,
            "set": self._set,
        }
        self._socket = RunSocket(path, executive, ports, answers=answers, slow=SLOW)
        self._desk = self._socket.desk
        self._leases: Leases | None = None
        if arming is not None:
            self._leases = Leases(arming, self._socket.read_next)
            executive.hooks.append(self._leases)

    def close(self) -> None:
        """Stop listening."""
        self._socket.close()

    def _arm(self, request: Request) -> Answer:
        refuse_more(request, "lease_s")
        lease_s = request.get("lease_s")
        if lease_s is not None:
            length(lease_s)
        if self._arming is None:
            return {"refused": [], "armed": True}
        epoch = self._arming.epoch
        was_taken = abs(epoch) > self._desk.asked_at
        if (why := _TAKEN_SINCE if was_taken else self._why_outdated()) is not None:
            return {"refused": [why], "armed": self._arming.armed}
        refused = self._arming.request(self._executive.clock.now(), epoch)
        answer: Answer = {"refused": refused, "armed": self._arming.armed}
        if lease_s is not None and self._leases is not None and not refused:
            answer["lease"] = self._leases.take(lease_s)
        return answer

    def _why_outdated(self) -> str | None:
        """Return why a request counts no more: a run that stood still finds it when it goes on."""
        return why_late(monotonic_ns() - self._desk.asked_at, TIMEOUT_S)

    def _disarm(self, request: Request) -> Answer:
        refuse_more(request)
        self._desk.refuse_waiting("arm", "disarmed on request before this was judged")
        if self._arming is None:
            return {"refused": [ALWAYS_ARMED], "armed": True}
        return {"not_safe": self._arming.disarm("requested"), "armed": self._arming.armed}

    def _renew(self, request: Request) -> Answer:
        refuse_more(request, "lease")
        lease = request.get("lease")
        is_leased = self._leases is None or self._leases.renew(lease, self._desk.asked_at)
        return {"lease": lease, "leased": is_leased, **self._state({})}

    def _state(self, request: Request) -> Answer:
        refuse_more(request)
        is_armed = self._arming is None or self._arming.armed
        reason = None if self._arming is None or is_armed else self._arming.reason
        return {
            "run": self._run,
            "armed": is_armed,
            "reason": reason,
            "revision": self._tuning.revision,
        }

    def _get(self, request: Request) -> Answer:
        refuse_more(request)
        return {"values": self._tuning.values, "revision": self._tuning.revision}

    def _set(self, request: Request) -> Answer:
        refuse_more(request, "values")
        values = request.get("values")
        if not (isinstance(values, Mapping) and values):
            raise ConfigError("request", ["values: expected an object, a value for each key"])
        if (why := self._why_outdated()) is not None:
            raise ConfigError("request", [why])
        changed = self._tuning.set(values)
        now = self._tuning.values
        self._log(f"set {', '.join(f'{key} = {now[key]}' for key in changed) or 'nothing new'}")
        return {"refused": [], "changed": changed, **self._get({})}


SHORTEST_S: Final = 0.05
LONGEST_S: Final = 60.0
AT_ONCE: Final = 16
"""How many requests are read before a lease is taken to have run out."""


class Leases:
    """Leases on an armed robot: a hook that disarms it when one is not renewed in time.

        arm with lease_s --> armed --renew, in time--> armed
        armed --no renewal for lease_s--> disarmed

    So a robot does not stay armed when the process that armed it is gone, or stuck. Several may
    have a lease at a time. Whatever else disarms the robot ends them all, unless it is to be armed
    again by itself, as after a silence of its link. `read` handles one request that waits, and says
    whether there was one.
    """

    def __init__(
        self,
        arming: Arming,
        read: Callable[[], bool],
        now: Callable[[], int] = monotonic_ns,
    ) -> None:
        self._arming = arming
        self._read = read
        self._now = now
        self._lengths: dict[str, int] = {}
        self._ends: dict[str, int] = {}

    def take(self, lease_s: object) -> str:
        """A new lease on a robot that is armed; its name. Raises ConfigError for no such time."""
        lease = os.urandom(8).hex()
        self._lengths[lease] = length(lease_s)
        self.renew(lease, self._now())
        return lease

    def renew(self, lease: object, sent_at: int) -> bool:
        """Renew a lease as of the instant of the renewal, ns; return whether there is such a one.

        One that a run which stood still finds when it goes on may be old, and its sender gone.
        """
        if not isinstance(lease, str) or lease not in self._lengths:
            return False
        self._ends[lease] = max(self._ends.get(lease, 0), sent_at + self._lengths[lease])
        return True

    def between_steps(self, _now: int, _left: int) -> None:
        """Disarm when a lease has run out, of which no renewal waits to be read."""
        if not self._ends:
            return
        if not (self._arming.armed or self._arming.is_wanted):
            self._end()
        elif self._first_end() <= self._now():
            for _ in range(AT_ONCE):
                if not self._read():
                    break
            self._judge()

    def _judge(self) -> None:
        now = self._now()
        out = [lease for lease, end in self._ends.items() if end <= now]
        if out:
            length_s = self._lengths[out[0]] / SECOND
            self._end()
            self._arming.disarm(f"no sign for {length_s:g} s of the process that armed it")

    def _first_end(self) -> int:
        return min(self._ends.values(), default=NEVER)

    def _end(self) -> None:
        self._lengths.clear()
        self._ends.clear()


def length(lease_s: object) -> int:
    """A lease's time in ns. Raises ConfigError."""
    is_number = isinstance(lease_s, int | float) and not isinstance(lease_s, bool)
    if not (is_number and SHORTEST_S <= lease_s <= LONGEST_S):  # type: ignore[operator] # a number
        expected = f"expected seconds, from {SHORTEST_S:g} to {LONGEST_S:g}"
        raise ConfigError("request", [f"lease_s: {lease_s!r}: {expected}"])
    return round(lease_s * SECOND)  # type: ignore[operator] # likewise
