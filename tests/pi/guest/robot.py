"""A robot on the real controller: started, armed, killed, and switched off whatever happens."""

import json
import signal
from collections.abc import Callable
from pathlib import Path
from time import monotonic_ns
from typing import Any

from tests.pi.guest.emulated import PROGRAM, log_of, may_drive, started, tried, waited
from tests.vm.guest.machine import expect


class Robot:
    """A board with its settings; `is_off` reads its outputs back."""

    def __init__(self, board: str, settings: Path, is_off: Callable[[], bool]) -> None:
        self.board = board
        self.settings = settings
        self.is_off = is_off

    def start(self) -> None:
        """Start guard and run."""
        self._guard = started(*PROGRAM, "guard", self.settings, log=f"guard of {self.board}")
        self._run = started(*PROGRAM, "run", self.settings, log=f"run of {self.board}")
        waited(lambda: tried("stats", self.board).returncode == 0, "it runs")

    def arm(self) -> None:
        """Arm it as soon as nothing speaks against it."""
        may_drive(outputs=True)
        waited(lambda: tried("arm", self.board).returncode == 0, "armed")

    def is_driven(self) -> None:
        """Wait until an output is on."""
        waited(lambda: not self.is_off(), "an output is on")

    def switched_off(self) -> float:
        """Wait until all outputs are off; return how long that was, ms."""
        since = monotonic_ns()
        waited(self.is_off, "all outputs are off")
        may_drive(outputs=False)
        return (monotonic_ns() - since) / 1e6

    def kill(self) -> str:
        """Kill the run, which leaves the chips as they were; how long until all were off."""
        self._run.send_signal(signal.SIGKILL)
        return f"off after {self.switched_off():.0f} ms"

    @property
    def said(self) -> str:
        """What the run has said."""
        return log_of(f"run of {self.board}")

    def is_armed(self) -> bool:
        """Wait for its figures; return whether they say so."""
        seen: list[dict[str, Any]] = []

        def has_figures() -> dict[str, Any]:
            seen.append(self.statistics())
            return seen[-1]

        waited(has_figures, "its figures")
        return bool(seen[-1]["conditions"]["run"]["armed"])

    def faults(self, model: str) -> dict[str, Any]:
        """What its figures say of a model's faults, by kind."""
        return dict(self.statistics().get("faults", {}).get(model, {}))

    def statistics(self) -> dict[str, Any]:
        """What `stats --json` says; nothing where the run had no pause to be read in."""
        done = tried("stats", self.board, "--json")
        return dict(json.loads(done.stdout)) if done.returncode == 0 else {}

    def end(self) -> str:
        """Make it safe and end run and guard; what safe-state said."""
        done = tried("safe-state", self.settings)
        expect(done.returncode == 0, done.stderr)
        waited(self.is_off, "all outputs are off")
        for process in (self._run, self._guard):
            process.terminate()
            process.wait()
        return done.stdout.strip()
