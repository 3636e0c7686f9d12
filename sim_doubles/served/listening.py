"""A path that a server listens at: taken if it is free or its last owner is dead, given back."""

from contextlib import suppress
from pathlib import Path
from socket import AF_UNIX, SOCK_SEQPACKET, socket

from firmware_runtime.hal.served.connection import lock_of
from sim_doubles.served.errors import ServingError


def listen(path: Path) -> socket:
    """Listen at a path.

    Raises ServingError if a living server has it, something else lies there, or the folder does
    not take it.
    """
    listener = socket(AF_UNIX, SOCK_SEQPACKET)
    try:
        if path.is_socket():
            _remove_dead(path)
        listener.bind(str(path))
        lock_of(path).touch()
        listener.listen()
    except OSError as error:
        listener.close()
        reason = error.strerror or error
        raise ServingError(f"{path}: no socket here ({reason}); expected a free path") from error
    except ServingError:
        listener.close()
        raise
    return listener


def unlisten(listener: socket, path: Path) -> None:
    """Close the listener and remove its path."""
    listener.close()
    for each in (path, lock_of(path)):
        with suppress(FileNotFoundError):
            each.unlink()


def _remove_dead(path: Path) -> None:
    """Remove a socket without a listener; refuse one that has a listener."""
    with socket(AF_UNIX, SOCK_SEQPACKET) as probe:
        probe.setblocking(False)
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()
            return
        except OSError:
            pass  # too busy to answer, or of another kind: it lives
    raise ServingError(f"{path}: another server listens here; expected a free path")
