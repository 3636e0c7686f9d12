"""Two network namespaces with a cable between them: two machines, as far as networks go.

    controller's namespace 10.77.0.1 ---- veth ---- 10.77.0.2 robot's namespace

They need root, `ip` and `nsenter`. `tc netem` impairs each end of the cable where the kernel has
it. Names say whose they are (`fr-PID-START-c`), so what a process left behind that was killed is
removed at the next start.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from os import geteuid
from shutil import which
from typing import Final

from firmware_runtime.devs.time import MICROSECOND
from firmware_runtime.links.cut.impaired_path import Impairment
from firmware_runtime.system.programs import ProgramFailed, answer_of
from firmware_runtime.system.this_process import (
    ProcessIdentity,
    boot_id,
    is_running,
    this_process,
)

CONTROLLER_AT: Final = "10.77.0.1"
ROBOT_AT: Final = "10.77.0.2"
_TOOLS: Final = ("ip", "nsenter")
_PREFIX: Final = "fr"
_TIMEOUT_S: Final = 20.0


def why_not() -> str | None:
    """Return why there can be no namespaces here, before any is tried; None if they can."""
    if geteuid() != 0:
        return "it takes root"
    missing = [tool for tool in _TOOLS if which(tool) is None]
    return f"no {' and no '.join(missing)}" if missing else None


class Namespaces:
    """A pair of them, made and joined; `remove` takes them away, with all that is in them."""

    def __init__(self) -> None:
        owner = this_process()
        stem = f"{_PREFIX}-{owner.pid}-{owner.started_ticks or 0}"
        self.controller, self.robot = f"{stem}-c", f"{stem}-r"

    def make(self) -> None:
        """Make both and the cable between them. Raises ProgramFailed; then none is left."""
        try:
            for name in (self.controller, self.robot):
                _run("ip", "netns", "add", name)
                _run("ip", "-n", name, "link", "set", "lo", "up")
            ends = ("veth0", "netns", self.controller), ("veth0", "netns", self.robot)
            _run("ip", "link", "add", *ends[0], "type", "veth", "peer", "name", *ends[1])
            for name, address in ((self.controller, CONTROLLER_AT), (self.robot, ROBOT_AT)):
                _run("ip", "-n", name, "address", "add", f"{address}/30", "dev", "veth0")
                _run("ip", "-n", name, "link", "set", "veth0", "up")
        except ProgramFailed:
            self.remove()
            raise

    def impair(self, how: Impairment) -> None:
        """Let the kernel impair what leaves either end. Raises ProgramFailed if it cannot."""
        if which("tc") is None:
            raise ProgramFailed("no tc")
        for name in (self.controller, self.robot):
            _run("tc", "-n", name, "qdisc", "add", "dev", "veth0", "root", "netem", *netem(how))

    def remove(self) -> None:
        """Take both away; harmless where there is none."""
        for name in (self.controller, self.robot):
            _delete(name)


def inside(name: str) -> list[str]:
    """Return the words that run a command in a namespace; all else stays as it is."""
    return ["nsenter", f"--net=/run/netns/{name}"]


def netem(how: Impairment) -> Sequence[str]:
    """An impairment in the words of `tc netem`; it has no seed of its own before Linux 6.6."""
    words = ["delay", f"{how.delay // MICROSECOND}us", f"{how.jitter // MICROSECOND}us"]
    shares = {"loss": how.loss, "duplicate": how.duplicate, "reorder": how.reorder}
    for name, share in shares.items():
        words += [name, f"{share * 100:g}%"] if share > 0 else []
    return [*words, "limit", "10000"]


def remove_leftovers() -> list[str]:
    """Remove namespaces whose owners are not running any more; return their names."""
    removed = []
    for name in _names():
        if (owner := _owner(name)) is not None and not is_running(owner):
            _delete(name)
            removed.append(name)
    return removed


@contextmanager
def made() -> Iterator[Namespaces]:
    """A pair within the block. Raises ProgramFailed."""
    pair = Namespaces()
    pair.make()
    try:
        yield pair
    finally:
        pair.remove()


def _names() -> list[str]:
    with suppress(ProgramFailed):
        return [line.split()[0] for line in _run("ip", "netns", "list").splitlines() if line]
    return []


def _owner(name: str) -> ProcessIdentity | None:
    """The process that made a namespace of this name; None for one of another program's."""
    prefix, *words = name.split("-")
    if prefix != _PREFIX or len(words) != 3 or not (words[0] + words[1]).isdigit():
        return None
    return ProcessIdentity(int(words[0]), int(words[1]), boot_id())


def _delete(name: str) -> None:
    with suppress(ProgramFailed):  # it is gone already
        _run("ip", "netns", "delete", name)


def _run(*command: str) -> str:
    return answer_of(command, timeout_s=_TIMEOUT_S)
