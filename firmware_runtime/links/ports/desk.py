"""Requests to a run: what answers each, and when there is time for it.

    {"request": "arm", "lease_s": 0.4}  -> {"refused": [], "armed": true, "lease": "5f0c"}
    {"request": "set", "values": {"controller.yaw.kp": 0.8}, "within_s": 1.0}

What takes longer than a step may be late (`slow`) waits until the next event is far enough away. A
request that is found later than `within_s` after it was sent, as by a run that stood still, is
refused: its sender has already reported that there was no answer.
"""

from collections import deque
from collections.abc import Callable, Mapping
from time import monotonic_ns
from typing import Any, Final, NamedTuple, TypeAlias

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.ports.datagrams import Ask

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
        """Refuse the slow requests of this name that wait."""
        for each in [each for each in self.waiting if each.request.name == name]:
            self.waiting.remove(each)
            each.reply({"refused": [why]})

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
    if not isinstance(within_s, int | float):
        raise ConfigError("request", [f"within_s: {within_s!r}: expected seconds"])
    if (fault := why_late(age, within_s)) is not None:
        raise ConfigError("request", [fault])


def why_late(age: int, within_s: float) -> str | None:
    """Return why a request of this age in ns is not answered any more; None where it is."""
    if age <= within_s * SECOND:
        return None
    fault = f"sent {age / SECOND:.1f} s ago, to be answered within {within_s:g} s"
    return f"{fault}; expected one that is still waited for"
