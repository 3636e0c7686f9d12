"""The way between two ends on this machine: loopback, or a bad network that stands in for WiFi.

A bad network is, by what the machine allows:

1. two network namespaces, each end of the cable between them impaired by the kernel (`tc netem`);
2. two namespaces and a process that impairs, where the kernel has no netem;
3. loopback and that process, where there can be no namespaces.
"""

import json
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from select import select
from typing import Any, Final

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.stages import namespaces
from firmware_runtime.lab.stages.namespaces import CONTROLLER_AT, ROBOT_AT, Namespaces
from firmware_runtime.links.cut.impaired_path import Impairment
from firmware_runtime.links.endpoint import endpoint, written
from firmware_runtime.links.key_file import read_key, write_key
from firmware_runtime.system.own_folder import own_folder
from firmware_runtime.system.programs import ProgramFailed, end_within

_PATIENCE_S: Final = 60.0


class PathProcess:
    """An `impaired_path` to the robot's address, with a front and a back socket at `host`.

    Raises ConfigError if it does not start.
    """

    def __init__(self, host: str, robot: str, how: Impairment, before: Sequence[str] = ()) -> None:
        module = "firmware_runtime.links.cut.impaired_path"
        at = f"{host}:0"
        words = [*before, sys.executable, "-m", module, at, at, robot, str(how)]
        self._process = subprocess.Popen(  # noqa: S603 -- this program itself
            words,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            process_group=0,
        )
        self._counts: dict[str, object] | None = None
        addresses = self._line()
        if not addresses:
            self.end()
            raise ConfigError("impairment", [f"{host}: its process did not start"])
        self.front: str = addresses["front"]
        self.back: str = addresses["back"]

    def end(self) -> dict[str, object]:
        """End it; what became of the datagrams, by way, or nothing if it was killed."""
        if self._counts is None:
            self._counts = self._end()
        return self._counts

    def _end(self) -> dict[str, object]:
        assert self._process.stdin is not None  # noqa: S101 -- it was asked for
        assert self._process.stdout is not None  # noqa: S101 -- likewise
        self._process.stdin.close()
        counts = self._line()
        end_within(self._process, _PATIENCE_S)
        self._process.stdout.close()
        return counts

    def _line(self) -> dict[str, Any]:
        """The next line that it prints; empty if there comes none in time."""
        assert self._process.stdout is not None  # noqa: S101 -- it was asked for
        ready, _, _ = select([self._process.stdout], (), (), _PATIENCE_S)
        line = self._process.stdout.readline() if ready else b""
        found: dict[str, Any] = json.loads(line) if line else {}
        return found


WIFI: Final = Impairment(delay=40_000_000, jitter=10_000_000, loss=0.02)
"""A loop of some 80 ms, as the paper measured over WiFi, and some loss."""
_LOOPBACK: Final = "127.0.0.1"
_PORT: Final = 7302
"""In namespaces of our own, where every port is free."""


def _nothing() -> dict[str, object]:
    return {}


@dataclass(slots=True)
class Way:
    """Addresses of both ends, and how they reach each other."""

    controller_link: str
    robot_link: str
    conditions: dict[str, Any]
    """Description of the link, for the result."""
    before_controller: list[str] = field(default_factory=list)
    before_robot: list[str] = field(default_factory=list)
    finish: Callable[[], dict[str, object]] = _nothing
    """Ends what impairs; returns what it has counted."""


@contextmanager
def loopback() -> Iterator[Way]:
    """UDP on this machine's loopback, as good as it gets."""
    controller, robot = _free_addresses()
    conditions = {"over": "udp", "between": "loopback", "impairment": None}
    yield Way(_udp(controller, robot), _udp(robot, controller), conditions)


@contextmanager
def to_peer(peer: str, key: Path) -> Iterator[Way]:
    """The robot end is on another machine, and listens there. Raises ConfigError."""
    endpoint("--peer", peer)
    read_key(key, "--key")
    conditions = {"over": "udp", "between": f"this machine and {peer}", "impairment": None}
    yield Way(f"udp:{peer},key={key}", "", conditions)


@contextmanager
def ros_graph() -> Iterator[Way]:
    """Topics of ROS 2, between nodes of this machine."""
    yield Way("ros2", "ros2", {"over": "ros2", "between": "this machine", "impairment": None})


@contextmanager
def bad_network(how: Impairment, say: Callable[[str], None]) -> Iterator[Way]:
    """A network with this impairment; reasons for a makeshift are said."""
    with ExitStack() as stack:
        key, pair = stack.enter_context(_key()), _namespaces(stack, say)
        conditions: dict[str, object] = {"over": "udp", "between": "loopback"}
        host, inside_controller, inside_robot = _LOOPBACK, list[str](), list[str]()
        if pair is None:
            controller, robot = _free_addresses()
        else:
            controller, robot = f"{CONTROLLER_AT}:{_PORT}", f"{ROBOT_AT}:{_PORT}"
            host, conditions["between"] = CONTROLLER_AT, "two network namespaces"
            inside_controller = namespaces.inside(pair.controller)
            inside_robot = namespaces.inside(pair.robot)
        to_robot, to_controller, finish = robot, controller, _nothing
        conditions["impairment"] = {"by": "tc netem", "how": str(how)}
        if (why_not := _netem_fault(pair, how)) is not None:
            path = PathProcess(host, robot, how, inside_controller)
            stack.callback(path.end)
            to_robot, to_controller, finish = path.front, path.back, path.end
            conditions["impairment"] = {"by": "a process", "no_netem": why_not, "how": str(how)}
        yield Way(
            _udp(controller, to_robot, key),
            _udp(robot, to_controller, key),
            conditions,
            inside_controller,
            inside_robot,
            finish,
        )


def _netem_fault(pair: Namespaces | None, how: Impairment) -> str | None:
    """Let the kernel impair the cable between two namespaces; return why it does not."""
    if pair is None:
        return "no network namespaces"
    try:
        pair.impair(how)
    except ProgramFailed as error:
        return str(error)
    return None


def _namespaces(stack: ExitStack, say: Callable[[str], None]) -> Namespaces | None:
    """A pair of namespaces, or None where there can be none."""
    why = namespaces.why_not()
    if why is None:
        for name in namespaces.remove_leftovers():
            say(f"removed the network namespace {name}, whose owner is not running any more")
        try:
            return stack.enter_context(namespaces.made())
        except ProgramFailed as error:
            why = str(error)
    say(f"no network namespaces here ({why}); the bad network is a process on loopback")
    return None


def _udp(own: str, peer: str, key: Path | None = None) -> str:
    """A link's words for the end that listens at `own` and speaks to `peer`."""
    words = f"udp:{peer},listen={own}"
    return words if key is None else f"{words},key={key}"


@contextmanager
def _key() -> Iterator[Path]:
    """A key for this run alone, in a folder that only this user can read."""
    with own_folder() as folder:
        path = folder / "key"
        write_key(path)
        yield path


def _free_addresses() -> tuple[str, str]:
    """Two addresses of loopback at which nothing listens now."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):
        one.bind((_LOOPBACK, 0))
        other.bind((_LOOPBACK, 0))
        return written(one.getsockname()), written(other.getsockname())
