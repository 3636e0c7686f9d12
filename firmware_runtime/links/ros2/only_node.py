"""One node a run: a second one would take every command twice and publish every value twice.

The claim is a socket with a name that is in no directory, so the kernel gives it up with the
process, whatever that ended of; and the process that has it is found by a connection.
"""

import errno
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path

from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.peer import peer_of


@contextmanager
def only_node_of(statistics: Path) -> Iterator[None]:
    """This process is the node of the run with these statistics, until it is left.

    Raises ConfigError if another process is.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as claim:
        name = _name_of(statistics)
        try:
            claim.bind(name)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
            raise ConfigError.of_one(
                str(statistics), f"another ROS 2 node of this run is up{_holder_of(name)}", "one"
            ) from error
        claim.listen()
        yield


def _name_of(statistics: Path) -> bytes:
    told_apart = sha256(os.fsencode(statistics.resolve())).hexdigest()
    return b"\0firmware-runtime-ros2-" + told_apart[:32].encode()


def _holder_of(name: bytes) -> str:
    """Return which process has the claim, if it can be known."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK) as asking:
        try:
            asking.connect(name)
            return f" (process {peer_of(asking).process})"
        except OSError:
            return ""
