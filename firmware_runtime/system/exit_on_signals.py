"""A signal ends a verb that does one thing after another: by SystemExit, once, so it tidies up."""

from collections.abc import Iterator
from contextlib import contextmanager

from firmware_runtime.errors import Status
from firmware_runtime.system.signals import stop_on_signals


def status_by(name: str) -> Status:
    """The exit status of a command that this signal stopped."""
    return Status.INTERRUPTED if name == "SIGINT" else Status.TERMINATED


@contextmanager
def exit_on_signals() -> Iterator[None]:
    """Within the block the first signal that asks to stop raises SystemExit; later ones do not.

    What the block is in the middle of is left by the way of any error: files go, processes end.
    """
    has_come = False

    def leave(name: str) -> None:
        nonlocal has_come
        if not has_come:
            has_come = True
            raise SystemExit(status_by(name))

    with stop_on_signals(leave):
        yield
