"""A robot in the guest: its units, its settings, and what its doubles saw."""

import json
import os
import re
import signal
from collections.abc import Mapping
from pathlib import Path
from time import monotonic_ns
from typing import Any, Final

from tests.vm.guest.machine import PROGRAM, PYTHON, Failed, attempt, device_of, run, wait_until

SITE_OF_BOARDS: Final = "import firmware_boards; print(firmware_boards.__path__[0])"


class Robot:
    """One board, installed as a service."""

    def __init__(self, board: str) -> None:
        self.board = board
        self.runtime = f"firmware-runtime@{board}.service"
        self.guard = f"firmware-runtime-guard@{board}.service"
        self.settings = Path(f"/etc/firmware-runtime/{board}.toml")
        self._log = Path(f"/var/log/doubles-{board}.log")

    # Its settings -------------------------------------------------------------------------------

    def write_settings(self, changes: Mapping[str, object]) -> None:
        """Make the user's copy: the board's own file with other values, by `table.key`."""
        package = run(PYTHON, "-c", SITE_OF_BOARDS).strip()
        text = Path(package, self.board, "board.toml").read_text(encoding="utf-8")
        self.settings.parent.mkdir(exist_ok=True)
        self.settings.write_text(text, encoding="utf-8")
        self.change({"buses.i2c1.device": str(device_of(self.board)), **changes})

    def change(self, changes: Mapping[str, object]) -> None:
        """Change values in the user's copy."""
        text = self.settings.read_text(encoding="utf-8")
        for key, value in changes.items():
            text = with_value(text, key, value)
        self.settings.write_text(text, encoding="utf-8")

    # Its units ----------------------------------------------------------------------------------

    def shown(self, name: str, unit: str = "") -> str:
        """A property of the runtime's unit, or of another one."""
        return run("systemctl", "show", "--property", name, "--value", unit or self.runtime).strip()

    def pid(self, unit: str = "") -> int:
        """The main process; 0 if there is none."""
        return int(self.shown("MainPID", unit))

    def wait_until_active(self) -> None:
        """Wait for READY of both units. Raises Failed."""
        for unit in (self.guard, self.runtime):
            self._wait_until_active(unit)

    def _wait_until_active(self, unit: str) -> None:
        wait_until(lambda: self.shown("ActiveState", unit) == "active", f"{unit} is active")

    def statistics(self) -> dict[str, Any]:
        """What `stats --json` says."""
        shown: dict[str, Any] = json.loads(run(PROGRAM, "stats", self.board, "--json"))
        return shown

    def is_armed(self) -> bool:
        """Whether the run may drive its outputs."""
        return bool(self.statistics()["conditions"]["run"]["armed"])

    # What is done to it -------------------------------------------------------------------------

    def arm_and_drive(self) -> None:
        """Arm it, as soon as it may be, and wait until an output is on. Raises Failed."""
        said = ""

        def armed() -> bool:
            nonlocal said
            done = attempt(PROGRAM, "arm", self.board)
            said = done.stderr.strip()
            return done.returncode == 0

        try:
            wait_until(armed, "armed")
        except Failed as failed:
            raise Failed(f"{failed}; the last refusal: {said}") from failed
        wait_until(lambda: not self.is_off(), "an output is on")

    def signal_run(self, number: signal.Signals) -> int:
        """Send the run's main process a signal; return when that was."""
        pid, at = self.pid(), monotonic_ns()
        os.kill(pid, number)
        return at

    # What its doubles saw -----------------------------------------------------------------------

    def _lines(self) -> list[dict[str, Any]]:
        whole = [
            line for line in self._log.read_text().splitlines(keepends=True) if line[-1] == "\n"
        ]
        return [json.loads(line) for line in whole]

    def is_off(self) -> bool:
        """Whether every output stands at 0."""
        return not any(
            {line["output"]: line["value"] for line in self._lines() if "output" in line}.values()
        )

    def levels(self, output: str) -> list[float]:
        """Every level that an output took, in order."""
        return [line["value"] for line in self._lines() if line.get("output") == output]

    def off_after_ms(self, since_ns: int) -> float:
        """Wait until all outputs are off; how long after an instant the last one went off."""
        wait_until(self.is_off, "all outputs are off")
        lines = self._lines()
        epoch = next(line["monotonic_ns"] for line in lines if line.get("event") == "serving")
        last = max(line["t_ns"] for line in lines if "output" in line)
        took: float = (epoch + last - since_ns) / 1e6
        return took


def with_value(text: str, key: str, value: object) -> str:
    """TOML with another value at `table.key`, which may be a default that the text leaves out.

    Whether there is such a key, the run itself says. Raises Failed if there is no such table.
    """
    table, _, name = key.rpartition(".")
    literal = json.dumps(value)
    header = rf"(?m)^\[{re.escape(table)}\].*\n"
    stated = re.search(rf"{header}(?:(?!\[).*\n)*?{name} = ([^#\n]*)", text)
    if stated:
        return f"{text[: stated.start(1)]}{literal} {text[stated.end(1) :]}"
    found = re.search(header, text)
    if not found:
        raise Failed(f"board.toml has no table {table} for {key}")
    return f"{text[: found.end()]}{name} = {literal}\n{text[found.end() :]}"
