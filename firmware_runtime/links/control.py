"""The control socket: requests to a run, answered by its own loop.

A Unix datagram socket beside the statistics (`BOARD.control`). A request is one word, the answer
one JSON object, sent back to the socket the request came from. The loop reads it between two steps,
as it reads any other source, one request a pass, so that a flood of them costs no more than one
each time, and never waits for a client: an answer that is not fetched is dropped.
Only the run's own user and root may ask: reading statistics takes fewer rights than moving motors.
"""

import json
import os
import socket
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias

from firmware_runtime.devs.ports import InPort
from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.links.socket_file import SocketFile

PATIENCE_S = 5.0
"""How long a request waits for its answer."""
_LONGEST = 4096

Answer: TypeAlias = dict[str, Any]


class ControlError(FirmwareRuntimeError):
    """A run cannot be spoken to."""


class ControlSocket:
    """The run's end, a source of its loop; `answers` has a function for every request.

    Raises ConfigError if the socket cannot be made.
    """

    def __init__(self, path: Path, answers: Mapping[str, Callable[[], Answer]]) -> None:
        self._answers = answers
        self._file = SocketFile(path, 0o600)
        self._socket = self._file.socket

    def fileno(self) -> int:
        """The descriptor that becomes readable when there is a request."""
        return self._socket.fileno()

    def receive(self) -> Sequence[tuple[InPort[Any], object]]:
        """Answer the request that waits longest; it is no value for the model."""
        with suppress(BlockingIOError):
            request, sender = self._socket.recvfrom(_LONGEST)
            answer = json.dumps(self._answer(request)).encode()
            with suppress(OSError, TypeError):  # who asked has gone, or has no address
                self._socket.sendto(answer, sender)
        return ()

    def close(self) -> None:
        """Stop listening; the socket of another run that has taken this one's place stays."""
        self._file.close()

    def _answer(self, request: bytes) -> Answer:
        answer = self._answers.get(request.decode(errors="replace"))
        if answer is None:
            return {"refused": [f"unknown request; expected one of {', '.join(self._answers)}"]}
        return answer()


def post(path: Path, request: str) -> None:
    """Send a request to a run, if there is one, and wait for nothing."""
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sending:
        sending.sendto(request.encode(), socket.MSG_DONTWAIT, os.fspath(path))


def ask(path: Path, request: str) -> Answer:
    """Send a request to a run and return its answer. Raises ControlError when there is none."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asking:
        asking.bind("")  # the kernel finds a name for the answer, in no directory
        asking.settimeout(PATIENCE_S)
        try:
            asking.sendto(request.encode(), os.fspath(path))
            answer: Answer = json.loads(asking.recv(_LONGEST))
        except TimeoutError as error:
            raise ControlError(
                f"{path}: no answer within {PATIENCE_S:g} s; expected the run to be alive"
            ) from error
        except OSError as error:
            why = error.strerror
            raise ControlError(f"{path}: {why}; expected a run that listens there") from error
        except (ValueError, RecursionError) as error:
            raise ControlError(f"{path}: answered with {error}; expected a JSON object") from error
    if not isinstance(answer, dict):
        raise ControlError(f"{path}: answered with {answer!r}; expected a JSON object")
    return answer
