"""What a run does on request of other processes, by its socket.

arm        arms, unless a pre-arm check fails; with `lease_s` only as long as it is renewed
disarm     makes outputs safe and keeps them so
renew      renews the `lease` of an `arm`
state      says whether it is armed, and why not
get        the gains and limits, by key
set        changes all that `values` names, or none
"""

import secrets
from collections.abc import Callable, Mapping
from pathlib import Path
from time import monotonic_ns

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.control import TIMEOUT_S
from firmware_runtime.links.ports.desk import Answer, Request, refuse_more, why_late
from firmware_runtime.links.ports.ports import Ports
from firmware_runtime.links.ports.run_socket import RunSocket
from firmware_runtime.runs.arming import Arming
from firmware_runtime.runs.leases import Leases, length
from firmware_runtime.runs.tuning import Tuning

ALWAYS_ARMED = (
    "this run has no outputs outside of itself, so there is nothing to disarm; on doubles of its "
    "own `run --supervised` arms and disarms"
)
_TAKEN_SINCE = "requested before the right to drive was taken; expected a request after that"
SLOW = {"arm": MILLISECOND // 2, "set": 5 * MILLISECOND}
"""Ns that a request may take, of those that would make a step late. All pre-arm checks take 0.2 to
0.4 ms on a PC, a setting, which is judged as a board's file is, 1.3 ms."""


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
        self._run = secrets.token_hex(8)
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
        was_taken = self._arming.was_taken_since(self._desk.asked_at)
        if (why := _TAKEN_SINCE if was_taken else self._why_outdated()) is not None:
            return {"refused": [why], "armed": self._arming.armed}
        refused = self._arming.request(self._executive.clock.now())
        answer: Answer = {"refused": refused, "armed": self._arming.armed}
        if lease_s is not None and self._leases is not None and not refused:
            answer["lease"] = self._leases.take(lease_s)
        return answer

    def _why_outdated(self) -> str | None:
        """Why a request counts no more: a run that stood still finds it when it goes on."""
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
