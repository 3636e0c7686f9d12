"""The verbs of the command line, in the groups in which `--help` shows them.

A verb of this package is a line here and a module of `commands`. Other packages add theirs by entry
points: a module with `add_to`, and if it likes with `HELP_GROUP` and `HELP_LINE`, which say where
and how `--help` shows it.
"""

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Final, NamedTuple

from firmware_runtime.system.packages import installed

ADDED: Final = "firmware_runtime.commands"
"""Entry points of verbs that other packages add: a module with `add_to`."""
OTHERS: Final = "others"
"""The group of a verb of another package that names none."""


class Verb(NamedTuple):
    """Where a verb is, and its line in `--help`."""

    module: str
    """In `commands`."""
    summary: str


GROUPS: Final[Mapping[str, Mapping[str, Verb]]] = {
    "make": {
        "new": Verb("new", "Write a robot, a chip or a key to begin with."),
        "check": Verb("check", "Find every fault in a board's settings."),
        "show": Verb("show", "List the boards; show or draw a model."),
    },
    "run": {
        "run": Verb("run", "Run a robot, or any model."),
        "arm": Verb("arm", "Let a run drive its outputs."),
        "disarm": Verb("arm", "Make a run's outputs safe; it runs on."),
        "set": Verb("set", "Show or change a run's gains and limits."),
        "guard": Verb("guard", "Switch off when a board's run dies or hangs."),
        "safe-state": Verb("safe_state", "Switch every output of a board full-off."),
    },
    "see": {
        "play": Verb("play", "Start a robot on doubles, its guard and page."),
        "view": Verb("view", "Open a page on a run, live or recorded."),
        "stats": Verb("stats", "Show a run's statistics, or serve them."),
        "top": Verb("top", "Show a run's timing live in the terminal."),
        "report": Verb("report", "Make a page of a run's timing."),
        "blame": Verb("blame", "Follow a run: why it is late, what ran."),
    },
    "run again": {
        "recordings": Verb("recordings", "List, keep, recover or collect recordings."),
        "replay": Verb("replay", "Run a recorded run again, and compare."),
        "debug": Verb("debug", "Step through a recorded run, also back."),
        "export": Verb("export", "Write a run or a model for other programs."),
        "continuity": Verb("continuity", "Certify that each stage's run replays."),
    },
    "study": {
        "experiment": Verb("experiment", "Repeat an experiment: data, plot and page."),
        "sweep": Verb("sweep", "Run a board many times with other values."),
        "campaign": Verb("campaign", "Find the fault that breaks a robot."),
        "identify": Verb("identify", "Find mass, friction and delay from a run."),
        "tune": Verb("tune", "Find gains for a board's loop from a run."),
        "gate": Verb("gate", "Say whether HEAD is slower than BASE."),
        "bench": Verb("bench", "Measure the runtime beside its peers."),
    },
    "machine": {
        "doctor": Verb("doctor", "Find what on this machine spoils a run."),
        "service": Verb("service", "Make a board a service of systemd."),
        "deploy": Verb("deploy", "Install a board on another computer, by ssh."),
    },
    "connect": {
        "send": Verb("send", "Put values into ports of a running robot."),
        "watch": Verb("send", "Print what ports of a running robot send."),
        "bridge": Verb("bridge", "Carry ports of a running robot over UDP."),
        "ros2": Verb("ros2", "Be a ROS 2 node for a running robot."),
        "dover": Verb("dover", "Carry a robot's numbers to PowerDEVS and back."),
    },
}

VERBS: Final[Mapping[str, Verb]] = {
    name: verb for verbs in GROUPS.values() for name, verb in verbs.items()
}

OF_LINUX: Final = frozenset(
    {
        *("arm", "disarm", "set", "guard", "safe-state", "doubles", "blame", "gate", "doctor"),
        *("service", "probe", "try", "send", "watch", "bridge", "ros2", "play"),
    }
)
"""Verbs that need what Linux alone has, those of our other packages too."""


def verb_names() -> list[str]:
    """Every verb, those of other packages last."""
    return [*VERBS, *(each.name for each in installed(ADDED) if each.name not in VERBS)]


def help_lines() -> Iterator[str]:
    """The groups, each verb in a line; those of other packages where they say."""
    shown: dict[str, dict[str, str]] = {
        group: {name: verb.summary for name, verb in verbs.items()}
        for group, verbs in GROUPS.items()
    }
    others = [each for each in installed(ADDED) if each.name not in VERBS]
    if others:
        # Imports them; a start of one verb does without.
        added = import_module("firmware_runtime.cli.added_verbs")
        for each in others:
            if (found := added.described(each)) is not None:
                shown.setdefault(found.group, {})[each.name] = found.summary
    width = max(len(name) for verbs in shown.values() for name in verbs)
    for group, summaries in shown.items():
        yield f"{group}:"
        yield from (f"  {name:{width}}  {text}" for name, text in summaries.items())
        yield ""
