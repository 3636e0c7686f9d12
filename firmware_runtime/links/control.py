"""The control socket: requests to a run, answered by its own loop.

    arm                                  a word, or an object where there is more to say:
    {"request": "arm", "lease_s": 0.4}  -> {"refused": [], "armed": true, "lease": "5f0c"}
    {"request": "set", "values": {"controller.yaw.kp": 0.8}, "within_s": 1.0}

A Unix datagram socket beside the statistics (`BOARD.control`). The answer is one JSON object, sent
back to the socket the request came from. The loop reads it between two steps, as it reads any other
source, one request a pass, so that a flood of them costs no more than one each time, and never
waits for a client: an answer that is not fetched is dropped. What takes longer than a step may be
late (`slow`) waits until the next event is far enough away.
A request that is found later than `within_s` after it was sent, as by a run that stood still, is
refused: its sender has already reported that there was no answer.
Only the run's own user and root may ask: reading statistics takes fewer rights than moving motors.
"""

import json
import os
import socket
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic_ns
from types import MappingProxyType
from typing import Any, Final, NamedTuple, TypeAlias

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.age import BESIDE, age_of, note_ages
from firmware_runtime.links.errors import ControlError
from firmware_runtime.links.socket_file import SocketFile
from firmware_runtime.system import credentials

TIMEOUT_S = 5.0
"""How long a request waits for its answer."""
LONGEST: Final = 1 << 16
"""Bytes of the longest request and the longest answer."""
SLOW_PATIENCE: Final = SECOND // 2
"""Ns after which a slow request is answered all the same: a fast loop never has so much time."""
_MOST_SLOW = 8
_TO_SHOW = 200

Answer: TypeAlias = dict[str, Any]
Request: TypeAlias = dict[str, Any]
"""What came with the name of a request, by its keys."""
Respond: TypeAlias = Callable[[Request], Answer]
"""Raises ConfigError for a request that is refused."""


class ControlSocket:
    """The run's end, a source of its loop and a hook; `answers` has a function for every request.

    `slow` says of a request how many ns it may take. Raises ConfigError if the socket cannot be
    made.
    """

    def __init__(
        self,
        path: Path,
        answers: Mapping[str, Respond],
        slow: Mapping[str, int] = MappingProxyType({}),
    ) -> None:
        self._answers = answers
        self._slow = slow
        self._waiting: deque[_Asked] = deque()
        self._answer_at = 0
        self._file = SocketFile(path, 0o600)
        self._socket = self._file.socket
        note_ages(self._socket)
        self.asked_at = 0
        """When the request that is answered was sent, ns of CLOCK_MONOTONIC, by the kernel."""

    def fileno(self) -> int:
        """The descriptor that becomes readable when there is a request."""
        return self._socket.fileno()

    def receive(self) -> Sequence[tuple[InPort[Any], object]]:
        """Answer the request that waits longest; it is no value for the model."""
        self.answer_next()
        return ()

    def answer_next(self) -> bool:
        """Answer the request that waits longest; whether there was one."""
        try:
            datagram, beside, _, sender = self._socket.recvmsg(LONGEST, BESIDE)
        except BlockingIOError:
            return False
        asked = _Asked(_request_of(datagram), sender, monotonic_ns() - age_of(beside))
        if asked.request.get("request") in self._slow and len(self._waiting) < _MOST_SLOW:
            self._waiting.append(asked)
        else:
            self._answer(asked)
        return True

    def between_steps(self, now: int, left: int) -> None:
        """Answer a slow request, as soon as it makes no activation late."""
        if not self._waiting:
            self._answer_at = now + SLOW_PATIENCE
        elif left >= self._slow[self._waiting[0].request["request"]] or now >= self._answer_at:
            self._answer(self._waiting.popleft())

    def refuse_waiting(self, name: str, why: str) -> None:
        """Refuse the slow requests of this name that wait."""
        for each in [each for each in self._waiting if each.request["request"] == name]:
            self._waiting.remove(each)
            self._send({"refused": [why]}, each.sender)

    def close(self) -> None:
        """Stop listening; the socket of another run that has taken this one's place stays."""
        self._file.close()

    def _answer(self, asked: "_Asked") -> None:
        self.asked_at = asked.at
        self._send(self._answer_to(asked.request), asked.sender)

    def _answer_to(self, request: Request) -> Answer:
        respond = self._answers.get(request.pop("request", ""))
        if respond is None:
            return {"refused": [f"unknown request; expected one of {', '.join(self._answers)}"]}
        try:
            refuse_late(monotonic_ns() - self.asked_at, request.pop("within_s", None))
            return respond(request)
        except ConfigError as error:
            return {"refused": list(error.faults)}

    def _send(self, answer: Answer, sender: Any) -> None:  # noqa: ANN401 -- as sockets have it
        with suppress(OSError, TypeError):  # the client has gone, or has no address
            self._socket.sendto(json.dumps(answer).encode(), sender)


class _Asked(NamedTuple):
    """A request, the address of the client that waits for the answer, and when it was sent."""

    request: Request
    sender: Any
    at: int


def _request_of(datagram: bytes) -> Request:
    """The request of a datagram: an object, or a word alone; what is neither is no request."""
    text = datagram.decode(errors="replace")
    if not text.startswith("{"):
        return {"request": text[:_TO_SHOW]}
    with suppress(ValueError, RecursionError):
        found = json.loads(text)
        if isinstance(found.get("request"), str):
            return dict(found)
    return {}


def refuse_more(request: Request, *known: str) -> None:
    """Raise ConfigError for keys of a request that have no effect."""
    faults = [f"{key}: unknown key of this request" for key in request if key not in known]
    if faults:
        raise ConfigError("request", faults)


def refuse_late(age: int, within_s: object) -> None:
    """Raise ConfigError for a request of this age in ns that is not waited for any more."""
    if within_s is None:
        return
    if not isinstance(within_s, int | float):
        raise ConfigError("request", [f"within_s: {within_s!r}: expected seconds"])
    if (fault := why_late(age, within_s)) is not None:
        raise ConfigError("request", [fault])


def why_late(age: int, within_s: float) -> str | None:
    """Why a request of this age in ns is not answered any more, a sentence; None where it is."""
    if age <= within_s * SECOND:
        return None
    fault = f"sent {age / SECOND:.1f} s ago, to be answered within {within_s:g} s"
    return f"{fault}; expected one that is still waited for"


def post(path: Path, request: str) -> None:
    """Send a request to a run, if there is one, and wait for nothing."""
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sending:
        sending.sendto(request.encode(), socket.MSG_DONTWAIT, os.fspath(path))


def ask(path: Path, request: str, timeout_s: float = TIMEOUT_S, **more: object) -> Answer:
    """Send a request to a run and return its answer. Raises ControlError when there is none."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asking:
        asking.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        asking.bind("")  # the kernel finds a name for the answer, in no directory
        asking.settimeout(timeout_s)
        try:
            asking.sendto(written(request, **more), os.fspath(path))
            answer: Answer = json.loads(_answer_of_run(asking, path, timeout_s))
        except TimeoutError as error:
            raise ControlError(
                f"{path}: no answer within {timeout_s:g} s; expected the run to be alive"
            ) from error
        except OSError as error:
            is_closed = isinstance(error, PermissionError)
            expected = "the user of that run, or root" if is_closed else "a run that listens there"
            raise ControlError(f"{path}: {error.strerror or error}; expected {expected}") from error
        except (ValueError, RecursionError) as error:
            raise ControlError(f"{path}: answered with {error}; expected a JSON object") from error
    if not isinstance(answer, dict):
        raise ControlError(f"{path}: answered with {answer!r}; expected a JSON object")
    return answer


def _answer_of_run(asking: socket.socket, path: Path, timeout_s: float) -> bytes:
    """The first answer that comes from the socket at a path, by a process that may speak for it.

    Every program of this computer may send to a socket that has its name in no directory.
    """
    until = monotonic_ns() + round(timeout_s * SECOND)
    while True:
        asking.settimeout(max(until - monotonic_ns(), 1) / SECOND)
        answer, beside, _, sender = asking.recvmsg(LONGEST, credentials.BESIDE)
        if sender == os.fspath(path) and credentials.may_speak(beside, path):
            return answer


def written(request: str, **more: object) -> bytes:
    """A request as a datagram."""
    return json.dumps({"request": request, **more}).encode() if more else request.encode()
