"""What a page may ask for by name: arm and disarm, gains, and whatever other modules add.

Each is a function from what was said (JSON) to an answer (JSON, or bytes of a file). It raises
ConfigError for what it refuses.
"""

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, TypeAlias

from msgspec.structs import asdict

from firmware_runtime.board.setting_descriptions import described
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.control import ask
from firmware_runtime.live.run_state import IN_THE_RUN
from firmware_runtime.live.source import Source

Said: TypeAlias = Mapping[str, Any]
Act: TypeAlias = Callable[[Said], Any]

_SAFE_WITHIN_S: Final = 20.0
_NOT_ALLOWED: Final = "arming from the page is off; expected `view --allow-arm`"


class Actions:
    """The acts of one page; `can` says which it offers. `may_arm` lets it arm too."""

    def __init__(self, source: Source, *, may_arm: bool) -> None:
        self._source = source
        self._may_arm = may_arm
        self._reads: dict[str, Act] = {"settings": self._settings}
        self._changes: dict[str, Act] = {
            "arm": self._arm,
            "disarm": lambda _: self._ask("disarm"),
            "safe-state": self._make_safe,
            "set": self._set,
        }

    @property
    def can(self) -> dict[str, bool]:
        """Acts that the page offers."""
        is_live = self._source.is_live
        return {"arm": is_live and self._may_arm, "disarm": is_live, "set": is_live}

    def of(self, name: str, *, is_change: bool) -> Act | None:
        """The act of that name; one that changes something is asked for by POST alone."""
        return (self._changes if is_change else self._reads).get(name)

    @property
    def _run(self) -> Path:
        path = self._source.statistics_path
        if path is None or not self._source.is_live:
            raise ConfigError.of_one("view", "this is a recording", expected="a run under way")
        return path

    def _ask(self, request: str, **more: Any) -> dict[str, Any]:  # noqa: ANN401 -- JSON
        return ask(self._run, request, **more)

    def _arm(self, _said: Said) -> object:
        if not self._may_arm:
            raise ConfigError.of_one("arm", _NOT_ALLOWED)
        return self._ask("arm")

    def _make_safe(self, _said: Said) -> object:
        """Switch off what the board drives, whatever drives it, by the verb `safe-state`."""
        state, run = self._source.state, self._run
        doubles = None if state is None else state.doubles
        if doubles == IN_THE_RUN:  # which end with it: nothing else reaches them
            return self._ask("disarm")
        words = [self._source.board.name, "--statistics", str(run), "--reason", "asked by a page"]
        words += [] if doubles is None else ["--doubles", doubles]
        done = subprocess.run(  # noqa: S603 -- this very program
            [sys.executable, "-m", "firmware_runtime.cli", "safe-state", *words],
            capture_output=True,
            text=True,
            timeout=_SAFE_WITHIN_S,
            check=False,
        )
        said = (done.stdout + done.stderr).splitlines()
        return {"not_safe": said if done.returncode else [], "said": said}

    def _settings(self, _said: Said) -> object:
        """The gains and limits as they are, with their ranges and meanings."""
        board = self._source.board
        values = self._ask("get")["values"] if self._source.is_live else {}
        return {
            key: {**asdict(each), "range": each.range, "value": values.get(key)}
            for key, each in described(board.settings, board.retunable).items()
            if key in values
        }

    def _set(self, said: Said) -> object:
        values = said.get("values")
        if not isinstance(values, dict):
            raise ConfigError.of_one("set", "no values", expected='{"values": {KEY: VALUE}}')
        return self._ask("set", values=values)
