"""Addresses of `--link`: over what the two ends of a cut speak with each other.

    unix:PATH                                      two runs on one machine
    udp:HOST:PORT[,listen=HOST:PORT][,key=FILE]    over a network, by a carrier (`udp`)
    ros2[:key=FILE]                                over topics of ROS 2, by a carrier as well

PATH and HOST:PORT are of the end that has the hardware, at both ends alike: it listens there, and
the other one speaks to it. With `listen` an end listens there, and HOST:PORT is the other end.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Final, TypeAlias

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.cut.channel import CarrierChannel, Channel, Interpreter, PathChannel
from firmware_runtime.links.endpoint import Endpoint, endpoint
from firmware_runtime.links.key_file import read_key

OPTION: Final = "--link"
_LONGEST_PATH: Final = 90
"""Bytes of a path, so that the name of a role fits behind it: a socket's has 107."""


@dataclass(frozen=True, slots=True)
class End:
    """End that is to be opened: of which board, its role, and whether it has the hardware."""

    board: str
    role: str
    has_hardware: bool


OpenChannel: TypeAlias = Callable[[End], Channel]
"""Opens the way to the other end; raises ConfigError where that cannot be."""


def link_address(text: str) -> OpenChannel:
    """Read what `--link` says. Raises ConfigError."""
    scheme, _, rest = text.partition(":")
    if scheme not in _SCHEMES or (rest == "" and ":" in text):
        expected = "expected unix:PATH, udp:HOST:PORT[,listen=HOST:PORT][,key=FILE] or ros2"
        raise ConfigError.of_one(OPTION, f"{text!r}: {expected}")
    return _SCHEMES[scheme](rest)


def _unix(rest: str) -> OpenChannel:
    path = Path(rest).absolute()
    if not rest or len(str(path).encode()) > _LONGEST_PATH:
        fault = f"unix:{rest}: expected a path of {_LONGEST_PATH} bytes at most"
        raise ConfigError.of_one(OPTION, fault)

    def open_path(end: End) -> Channel:
        beside = path.with_name(f"{path.name}.other")
        return PathChannel(path, beside) if end.has_hardware else PathChannel(beside, path)

    return open_path


def _udp(rest: str) -> OpenChannel:
    where, *options = rest.split(",")
    stated = dict(option.partition("=")[::2] for option in options)
    if len(stated) < len(options):
        fault = f"udp:{rest}: expected each of listen=HOST:PORT and key=FILE once"
        raise ConfigError.of_one(OPTION, fault)
    if unknown := stated.keys() - {"listen", "key"}:
        fault = f"udp:{rest}: {min(unknown)!r}: expected listen=HOST:PORT or key=FILE"
        raise ConfigError.of_one(OPTION, fault)
    peer = _endpoint(where)
    own = _endpoint(stated["listen"]) if "listen" in stated else None
    if "key" in stated:
        read_key(Path(stated["key"]), OPTION)
    elif outside := [each for each in (peer, own) if each is not None and not each.is_loopback]:
        fault = f"udp:{rest}: {outside[0]} can be reached from elsewhere; expected key=FILE"
        raise ConfigError.of_one(OPTION, f"{fault}, or an address of the loopback")

    def open_carrier(end: End) -> Channel:
        return CarrierChannel("firmware_runtime.links.cut.udp", _arguments(end, where, stated))

    return open_carrier


def _endpoint(text: str) -> Endpoint:
    """An address that the other end can know beforehand."""
    found = endpoint(OPTION, text)
    if found.where[1] == 0:
        raise ConfigError.of_one(
            OPTION, f"{text}: port 0 is another one at every start", "one of 1 to 65535"
        )
    return found


def _arguments(end: End, where: str, stated: Mapping[str, str]) -> list[str]:
    """Return the arguments of the carrier over UDP."""
    listens = where if end.has_hardware else None
    own, peer = (stated["listen"], where) if "listen" in stated else (listens, where)
    words = [] if own is None else ["--listen", own]
    if not end.has_hardware or "listen" in stated:
        words += ["--peer", peer]
    return [*words, "--key", stated["key"]] if "key" in stated else words


def _ros2(rest: str) -> OpenChannel:
    name, _, key = rest.partition("=")
    if rest and (name != "key" or not key):
        raise ConfigError.of_one(OPTION, f"ros2:{rest}: expected ros2 or ros2:key=FILE")
    if key:
        read_key(Path(key), OPTION)

    def open_carrier(end: End) -> Channel:
        # what leads to ROS is imported where it is wanted
        interpreter = import_module("firmware_runtime.links.ros2.interpreter")
        interpreter.check_surroundings(os.environ)
        environment = interpreter.find_environment(None)
        words = interpreter.command_of(environment, ["-P"])
        variables = interpreter.variables_of(environment, os.environ)
        return CarrierChannel(
            "firmware_runtime.links.ros2.carrier",
            [*_topics(end), *(["--key", key] if key else [])],
            interpreter=Interpreter(words, variables),
        )

    return open_carrier


def _topics(end: End) -> list[str]:
    """Return the arguments of the carrier over ROS 2: the same topics at both ends, crosswise."""
    names = import_module("firmware_runtime.board.ros.names")
    namespace = f"/{names.node_name(end.board)}"
    sends, receives = ("from_robot", "to_robot")[:: 1 if end.has_hardware else -1]
    words = ["--namespace", namespace, "--role", names.ros_name(end.role)]
    return [*words, "--sends", f"link/{sends}", "--receives", f"link/{receives}"]


_SCHEMES: Final[dict[str, Callable[[str], OpenChannel]]] = {
    "unix": _unix,
    "udp": _udp,
    "ros2": _ros2,
}
