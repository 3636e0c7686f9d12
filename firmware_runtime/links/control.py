"""Requests to a run, from another process: `ask` waits for the answer, `post` for nothing."""

from contextlib import suppress
from pathlib import Path
from select import select
from time import monotonic_ns
from typing import TYPE_CHECKING, Any

from msgspec import MsgspecError
from msgspec.json import Decoder

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ControlError
from firmware_runtime.links.ports.datagrams import message_of
from firmware_runtime.links.ports.desk import Answer
from firmware_runtime.statistics.paths import Companion

if TYPE_CHECKING:
    from firmware_runtime.links.ports.robot_end import RobotEnd

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

    The run refuses what it finds once nobody waits for it any more, but for `disarm`. Raises
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
