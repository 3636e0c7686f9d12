"""One engine's run of a periodic model in real time: `python -m benchmarks.peers.run ENGINE JSON`.

The object has `plan`, what a `Plan` is made of, and `fifo_priority`; every engine has the same
settings of the process. Prints an object: `fired` of the plan, `cpu_s`, the settings granted, and
`told`, what the engine itself has to say about being late.
"""

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from time import process_time
from typing import Any

from msgspec import to_builtins

from benchmarks.peers.plan import Plan
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.process import ProcessSettings, in_force


@dataclass(frozen=True, slots=True)
class Engine:
    """A function here that runs a plan, and the package it needs, if any."""

    module: str
    function: str
    package: str | None

    @property
    def is_installed(self) -> bool:
        """Whether it can run."""
        return self.package is None or find_spec(self.package) is not None

    def runner(self) -> Callable[[Plan], str]:
        """The function; its module, and so the engine, is imported only now."""
        run: Callable[[Plan], str] = getattr(import_module(self.module), self.function)
        return run


ENGINES = {
    "ours, skip": Engine("benchmarks.peers.ours", "skip", None),
    "ours, catch-up": Engine("benchmarks.peers.ours", "catch_up", None),
    "xdevs.py": Engine("benchmarks.peers.xdevs", "run", "xdevs"),
    "SimPy": Engine("benchmarks.peers.simpy", "run", "simpy"),
    "pyjevsim": Engine("benchmarks.peers.pyjevsim", "run", "pyjevsim"),
}


def run(name: str, asked: dict[str, Any]) -> dict[str, Any]:
    """Run one engine."""
    plan, engine = Plan(**asked["plan"]), ENGINES[name].runner()
    settings = ProcessSettings(
        fifo_priority=asked["fifo_priority"],
        lock_memory=True,
        timer_slack_ns=1,
        keep_cpu_awake=True,
    )
    with in_force(settings, MonotonicClock()) as granted:
        before = process_time()
        told = engine(plan)
        cpu_s = process_time() - before
    return {"fired": plan.fired, "cpu_s": cpu_s, "settings": to_builtins(granted), "told": told}


if __name__ == "__main__":
    print(json.dumps(run(sys.argv[1], json.loads(sys.argv[2]))))
