"""A login as at a console: agetty started by systemd, login, password, shell."""

import os
import pty
from collections.abc import Iterator
from contextlib import contextmanager
from select import select
from time import monotonic
from typing import Final

from tests.vm.guest.machine import Failed, attempt, run

USER: Final = "visitor"
PASSWORD: Final = "secret"  # noqa: S105 -- of a user who lives in the guest, for seconds
HASHED: Final = (
    "$6$vmchecks$Z2oKqC6oNk9dlsO.8AEp0XPDXinjh9jIB1Wl4Q4dAFtxc5Gu96UKswS/RTMTkx6FMSrx6596RUA."
    "oR94ivUXo."
)
"""Of that password, by `openssl passwd -6`."""
GIVE_UP_S: Final = 60.0
UNIT: Final = "vm-login.service"


@contextmanager
def visitor() -> Iterator[None]:
    """Within the block there is a user who may log in."""
    run("useradd", "--no-create-home", "--home-dir", "/", "--password", HASHED, USER)
    try:
        yield
    finally:
        attempt("userdel", USER)


def log_in() -> float:
    """Log in, have the shell work something out, and log out; return how long that took, s."""
    ours, theirs = pty.openpty()
    terminal = os.ttyname(theirs)
    began_at = monotonic()
    try:
        run(
            *("systemd-run", "--quiet", "--collect", f"--unit={UNIT}", "--property=Type=idle"),
            *("--property=StandardInput=tty", "--property=StandardOutput=tty"),
            *(f"--property=TTYPath={terminal}", "--property=IgnoreSIGPIPE=no"),
            *("/sbin/agetty", "--noclear", "--keep-baud", "-", "dumb"),
            timeout_s=GIVE_UP_S,
        )
        for prompt, answer in (("login:", USER), ("Password:", PASSWORD), ("$", "expr 40 + 2")):
            _wait_for(ours, prompt, began_at)
            os.write(ours, f"{answer}\n".encode())
        _wait_for(ours, "42", began_at)
        return monotonic() - began_at
    finally:
        attempt("systemctl", "stop", UNIT)
        os.close(ours)
        os.close(theirs)


def _wait_for(terminal: int, text: str, began_at: float) -> None:
    """Read until the text has come. Raises Failed."""
    said = ""
    while text not in said:
        left = began_at + GIVE_UP_S - monotonic()
        if left <= 0 or not select([terminal], (), (), left)[0]:
            raise Failed(f"no login within {GIVE_UP_S:g} s: waited for {text!r}, got {said!r}")
        said += os.read(terminal, 4096).decode(errors="replace")
