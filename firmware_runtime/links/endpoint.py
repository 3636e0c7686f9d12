"""Addresses of UDP, `ADDRESS:PORT` on the command line: IPv4, IPv6 in brackets, or a name."""

import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Any, Final, TypeAlias

from firmware_runtime.errors import ConfigError
from firmware_runtime.system.whole_numbers import whole_number

_HIGHEST_PORT = 0xFFFF
AT_ONCE: Final = 64
"""Datagrams of a socket that are read before others have their turn."""
UdpAddress: TypeAlias = tuple[Any, ...]
"""An address as sockets have it: host, port, and of IPv6 two numbers more."""


@dataclass(frozen=True, slots=True)
class Endpoint:
    """Address of UDP; `where` is what `bind` and `connect` take."""

    family: socket.AddressFamily
    where: UdpAddress

    @property
    def is_loopback(self) -> bool:
        """Return whether only processes of this machine can reach it."""
        return ip_address(self.where[0]).is_loopback

    def __str__(self) -> str:
        return written(self.where)


def written(where: UdpAddress) -> str:
    """An address as people write it."""
    host, port = where[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def endpoint(option: str, text: str) -> Endpoint:
    """Read `text`, looking a name up once. Raises ConfigError that names the option."""
    host, _, port = text.rpartition(":")
    bare = host.removeprefix("[").removesuffix("]")
    number = whole_number(port, _HIGHEST_PORT)
    if not bare or number is None or (":" in bare and bare == host):
        fault = f"{text}: expected ADDRESS:PORT, such as 127.0.0.1:7300 or [::1]:7300"
        raise ConfigError.of_one(option, fault)
    try:
        (family, _, _, _, where), *_ = socket.getaddrinfo(bare, number, type=socket.SOCK_DGRAM)
    except OSError as error:
        raise ConfigError.of_one(option, f"{text}: {error.strerror}", "an address") from error
    except UnicodeError as error:  # a name with an empty part, or one of more than 63 letters
        raise ConfigError.of_one(option, f"{text}: no host name", "an address") from error
    return Endpoint(family, where)


def bound(option: str, at: Endpoint) -> socket.socket:
    """Return a UDP socket at an address, that never blocks. Raises ConfigError about the option."""
    return _made(option, at, "a free address", lambda made: made.bind(at.where))


def connected(option: str, to: Endpoint) -> socket.socket:
    """Return a UDP socket that sends to an address alone, and never blocks; raises ConfigError."""
    return _made(option, to, "a way there", lambda made: made.connect(to.where))


def datagrams(
    udp: socket.socket, longest: int, most: int = AT_ONCE
) -> Iterator[tuple[bytes, UdpAddress]]:
    """Yield what has come to a socket that never blocks, and from where; some of it at a time.

    What an earlier datagram of ours met on its way is passed over.
    """
    for _ in range(most):
        try:
            yield udp.recvfrom(longest)
        except BlockingIOError:
            return
        except OSError:
            continue


def _made(
    option: str, at: Endpoint, expected: str, use: Callable[[socket.socket], None]
) -> socket.socket:
    made = socket.socket(at.family, socket.SOCK_DGRAM)
    made.setblocking(False)
    try:
        use(made)
    except OSError as error:
        made.close()
        raise ConfigError.of_one(option, f"{at}: {error.strerror}", expected) from error
    return made
