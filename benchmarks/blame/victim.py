"""The process that is made late: a model of 100 Hz in real time, with its statistics in a file.

    python -m benchmarks.blame.victim CAUSE TIMES SEED CPU STATISTICS

It prints `ready` and waits for a line before it runs, so that it can be put where it belongs. After
the run it prints a JSON list: when each thing that it did itself began and ended, CLOCK_MONOTONIC.
"""

import json
import random
import signal
import sys
from pathlib import Path
from time import monotonic_ns

from benchmarks.blame.causes import INJECTED, PERIOD_MS, SPACING_S, WARM_UP_S
from benchmarks.blame.within import DEVICE, HZ, Act, SlowAdapter, act
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, seconds
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.process import ProcessSettings
from firmware_runtime.hal.accounted_bus import AccountedBus

PRIORITY = 50
EVERY = round(SPACING_S * 1000 / PERIOD_MS)
SAMPLE = 20
"""Bytes that are read in each tick: some 2 ms on the wire."""
FIRST = round(WARM_UP_S * 1000 / PERIOD_MS)


class Victim(Atomic):
    """Reads its device, and every tenth time does something else: waiting (period) --> waiting."""

    def __init__(self, bus: AccountedBus, act: Act | None, times: int) -> None:
        super().__init__("victim")
        self.period = PERIOD_MS * MILLISECOND
        self.windows: list[tuple[int, int]] = []
        self._bus, self._act, self._times = bus, act, times
        self._ticks = 0

    def initialize(self) -> None:
        """Wait."""
        self.hold_in("waiting", self.period)

    def internal(self) -> None:
        """One tick."""
        self._ticks += 1
        is_due = self._ticks > FIRST and self._ticks % EVERY == 0
        began = monotonic_ns()
        is_to_act = is_due and len(self.windows) < self._times
        if self._act is not None:
            self._act() if is_to_act else self._act.prepare()
        self._bus.write_read(DEVICE, b"\x00", SAMPLE)
        if self._act is not None and is_to_act:
            self.windows.append((began, monotonic_ns()))
        self.hold_in("waiting", self.period)


def main() -> None:
    """Run until the injections are over, or a signal says so."""
    cause, times, seed, cpu, statistics = sys.argv[1:6]
    how = INJECTED[cause]
    adapter = SlowAdapter()
    bus = AccountedBus(adapter, HZ)
    folder = Path(statistics).parent
    rng = random.Random(int(seed))  # noqa: S311 -- spans are no secret
    acting = act(cause, adapter, folder, rng, int(times)) if how.from_within else None
    victim = Victim(bus, acting, int(times))
    root = Coupled("bench")
    root.add(victim)
    settings = ProcessSettings(
        fifo_priority=PRIORITY if how.is_fifo else 0, cpus=(int(cpu),), freeze_garbage=True
    )
    configuration = Configuration(
        buses=[bus], process=settings, statistics_path=Path(statistics), worst=8 * int(times) + 16
    )
    executive = Executive(root, MonotonicClock(), list, configuration)
    signal.signal(signal.SIGTERM, lambda *_: executive.request_stop("SIGTERM"))
    print("ready", flush=True)
    sys.stdin.readline()
    executive.run(seconds(WARM_UP_S + (int(times) + 20) * SPACING_S * 10))
    print(json.dumps(victim.windows))


if __name__ == "__main__":
    main()
