"""Requests to a run, from another process: `ask` waits for the answer, `post` for nothing.

A run answers at its desk:

    {"request": "arm", "lease_s": 0.4}  -> {"refused": [], "armed": true, "lease": "5f0c"}
    {"request": "set", "values": {"controller.yaw.kp": 0.8}, "within_s": 1.0}

What takes longer than a step may be late (`slow`) waits until the next event is far enough away. A
request that is found later than `within_s` after it was sent, as by a run that stood still, is
refused: its sender has already reported that there was no answer.
"""

from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from select import select
from time import monotonic_ns
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

from msgspec import MsgspecError
from msgspec.json import Decoder

from firmware_runtime.devs.time import LONGEST_S, SECOND
from firmware_runtime.errors import ConfigError, ControlError
from firmware_runtime.links.ports.datagrams import Ask, message_of
from firmware_runtime.statistics.paths import Companion

if TYPE_CHECKING:
    from firmware_runtime.links.ports.robot_end import RobotEnd

SLOW_PATIENCE: Final = SECOND // 2
"""Ns after which a slow request is answered all the same: a fast loop never has so much time."""
_MOST_SLOW = 8

Answer: TypeAlias = dict[str, Any]
Request: TypeAlias = dict[str, Any]
"""What came with the name of a request, by its keys."""
Respond: TypeAlias = Callable[[Request], Answer]
"""Raises ConfigError for a request that is refused."""
Reply: TypeAlias = Callable[[Answer], None]


class _Asked(NamedTuple):
    """A request, the way to the process that waits for the answer, and when it was sent."""

    request: Ask
    reply: Reply
    at: int


class Desk:
    """Answers requests; `answers` has a function for each, `slow` how many ns it may take."""

    def __init__(self, answers: Mapping[str, Respond], slow: Mapping[str, int]) -> None:
        self._answers = answers
        self._slow = slow
        self.waiting: deque[_Asked] = deque()
        self._answer_at: int | None = None
        """When the first of them is answered all the same, an instant of the run."""
        self.asked_at = 0
        """When the request that is answered was sent, ns of CLOCK_MONOTONIC, by the kernel."""

    def take(self, request: Ask, age: int, reply: Reply) -> None:
        """Answer a request of this age, ns, now or when there is time for it."""
        asked = _Asked(request, reply, monotonic_ns() - age)
        if request.name in self._slow and len(self.waiting) < _MOST_SLOW:
            self.waiting.append(asked)
        else:
            self._answer(asked)

    def between_steps(self, now: int, left: int) -> None:
        """Answer the first slow request, as soon as it makes no activation late."""
        if self._answer_at is None:
            self._answer_at = now + SLOW_PATIENCE
        if left >= self._slow[self.waiting[0].request.name] or now >= self._answer_at:
            self._answer_at = None
            self._answer(self.waiting.popleft())

    def refuse_waiting(self, name: str, why: str) -> None:
        """Refuse the slow requests of this name that wait; the next one's patience begins then."""
        first = self.waiting[0] if self.waiting else None
        for each in [each for each in self.waiting if each.request.name == name]:
            self.waiting.remove(each)
            each.reply({"refused": [why]})
        if not self.waiting or self.waiting[0] is not first:
            self._answer_at = None

    def _answer(self, asked: _Asked) -> None:
        self.asked_at = asked.at
        asked.reply(self._answer_to(asked.request))

    def _answer_to(self, request: Ask) -> Answer:
        respond = self._answers.get(request.name)
        if respond is None:
            known = ", ".join(self._answers)
            return {"refused": [f"{request.name}: unknown request; expected one of {known}"]}
        stated = dict(request.stated)
        try:
            _refuse_late(monotonic_ns() - self.asked_at, stated.pop("within_s", None))
            return respond(stated)
        except ConfigError as error:
            return {"refused": list(error.faults)}


def refuse_more(request: Request, *known: str) -> None:
    """Raise ConfigError for keys of a request that have no effect."""
    faults = [f"{key}: unknown key of this request" for key in request if key not in known]
    if faults:
        raise ConfigError("request", faults)


def _refuse_late(age: int, within_s: object) -> None:
    """Raise ConfigError for a request of this age in ns that is not waited for any more."""
    if within_s is None:
        return
    if not (isinstance(within_s, int | float) and abs(within_s) <= LONGEST_S):
        raise ConfigError("request", [f"within_s: {within_s!r}: expected seconds"])
    if (fault := why_late(age, within_s)) is not None:
        raise ConfigError("request", [fault])


def why_late(age: int, within_s: float) -> str | None:
    """Return why a request of this age in ns is not answered any more; None where it is."""
    if age <= within_s * SECOND:
        return None
    fault = f"sent {age / SECOND:.1f} s ago, to be answered within {within_s:g} s"
    return f"{fault}; expected one that is still waited for"


TIMEOUT_S = 5.0
"""How long a request waits for its answer."""
_answered = Decoder(dict[str, Any]).decode
_UNTIL_IT_IS_DONE = "disarm"
"""The request that counts however late the run comes to it."""


def post(statistics: Path, request: str) -> None:
    """Send a request to the run with these statistics, if there is one, and wait for nothing."""
    path = Companion.SOCKET.beside(statistics)
    if not path.exists():
        return
    import socket  # noqa: PLC0415 -- takes 6 ms, before outputs are off, and mostly there is no run

    with (
        suppress(OSError),
        socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK) as sending,
    ):
        sending.connect(str(path))
        sending.send(message_of(request=request))


def ask(statistics: Path, request: str, timeout_s: float | None = None, **more: object) -> Answer:
    """Send a request to the run with these statistics and return its answer.

    The run refuses a request whose sender no longer waits, but for `disarm`. Raises
    ControlError when there is no answer, or none by that run.
    """
    timeout_s = TIMEOUT_S if timeout_s is None else timeout_s
    until = monotonic_ns() + round(timeout_s * SECOND)
    from firmware_runtime.links.ports.robot_end import RobotEnd  # noqa: PLC0415 -- as above

    end = RobotEnd(statistics)
    try:
        return _answer(end, until, request, more)
    except TimeoutError as error:
        if request == _UNTIL_IT_IS_DONE and not end.is_greeted:
            post(statistics, request)
        fault = end.why_not_believed or f"no answer within {timeout_s:g} s"
        raise ControlError(fault, where=end.path, expected="the run to be alive") from error
    except OSError as error:
        is_closed = isinstance(error, PermissionError)
        expected = "the user of that run, or root" if is_closed else "a run that listens there"
        fault = error.strerror or str(error)
        raise ControlError(fault, where=end.path, expected=expected) from error
    except MsgspecError as error:
        fault = f"answered with what is no JSON object ({error}); expected a run"
        raise ControlError(fault, where=end.path) from error
    finally:
        end.close()


def _answer(end: "RobotEnd", until: int, request: str, more: dict[str, object]) -> Answer:
    """Raises OSError, TimeoutError without an answer in time, and MsgspecError for what is none."""
    end.connect()
    while not end.is_greeted:
        _wait(end, until)
        for _ in end.received():
            pass
        if end.why_not_believed:
            raise TimeoutError
    if request != _UNTIL_IT_IS_DONE:
        more = {**more, "within_s": (until - monotonic_ns()) / SECOND}
    end.send(message_of(request=request, **more))
    while True:
        _wait(end, until)
        for said in end.received():
            return _answered(said)


def _wait(end: "RobotEnd", until: int) -> None:
    """Raises TimeoutError once there is no more time."""
    left = until - monotonic_ns()
    if left <= 0 or not select([end], (), (), left / SECOND)[0]:
        raise TimeoutError
