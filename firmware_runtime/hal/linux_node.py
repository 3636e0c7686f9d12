"""Linux reality: whether this process may open a device node; nothing but opening it tells.

A service's device policy is made when the service starts, from the nodes that are there then; it
does not show in the permissions of a node that came later.
"""

import os

from firmware_runtime.hal.errors import BusAbsent


def check_node(name: str, path: str) -> None:
    """Open a bus or port and close it again, which moves nothing on its wires. Raises BusAbsent."""
    try:
        os.close(os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC))
    except OSError as error:
        raise BusAbsent(
            f"{name}: {path} cannot be opened ({error.strerror}); expected a device node that this "
            "process may read and write"
        ) from error
