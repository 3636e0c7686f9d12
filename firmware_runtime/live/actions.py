"""What a page may ask for by name: arm and disarm, gains, and whatever other modules add.

Each is a function from what was said (JSON) to an answer (JSON, or bytes of a file). It raises
ConfigError for what it refuses.
"""

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Lock
from typing import Any, Final, TypeAlias

import msgspec

from firmware_runtime.board.retuning import retunable_values
from firmware_runtime.devs.time import LONGEST_S, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.control import ask
from firmware_runtime.live.breaking import breaks, clear, strike, test_text
from firmware_runtime.live.rewind import Rewind
from firmware_runtime.live.run_process import kill, stall
from firmware_runtime.live.run_state import IN_THE_RUN
from firmware_runtime.live.seen import exported
from firmware_runtime.live.source import Source
from firmware_runtime.live.tuning_trial import board_file, sliders, trial
from firmware_runtime.statistics.json_values import NOT_JSON
from firmware_runtime.statistics.summary import summary
from firmware_runtime.view.report.report import report

Said: TypeAlias = Mapping[str, Any]
Act: TypeAlias = Callable[[Said], Any]

_SAFE_WITHIN_S: Final = 20.0
_NOT_ALLOWED: Final = "arming from the page is off; expected `view --allow-arm`"


class Actions:
    """The acts of one page; `can` says which it offers. `may_arm` lets it arm too."""

    def __init__(self, source: Source, *, may_arm: bool) -> None:
        self._source = source
        self._may_arm = may_arm
        self._rewind: Rewind | None = None
        self._lock = Lock()
        self._reads: dict[str, Act] = {
            "report": self._report,
            "instant": self._instant,
            "sliders": self._sliders,
            "board-file": self._board_file,
            "export": self._export,
            "breaks": lambda _: breaks(self._doubles),
            "break-test": lambda _: test_text(self._doubles).encode(),
        }
        self._changes: dict[str, Act] = {
            "arm": self._arm,
            "disarm": lambda _: self._ask("disarm"),
            "safe-state": self._make_safe,
            "set": self._set,
            "try": self._try,
            "stall": self._stall,
            "kill": self._kill,
            "break": self._break,
            "clear": lambda _: clear(self._doubles),
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

    # What is seen ---------------------------------------------------------------------------------

    def _report(self, _said: Said) -> object:
        """The timing of the run, as a page of parts."""
        statistics = self._source.statistics
        if statistics is None:
            expected = "a run under way, or the last one, by its board's name"
            raise ConfigError.of_one("report", "no statistics of this run", expected=expected)
        return report(statistics, summary(statistics.figures()))

    def _instant(self, said: Said) -> object:
        """An instant of the recording, by `at` in ns; with `snapshot` of all until now."""
        at = number_in(said, "at")
        with self._lock:
            rewind = self._rewind
            is_beyond = rewind is not None and at > rewind.end_ns and self._source.is_live
            if rewind is None or is_beyond or "snapshot" in said:
                rewind = self._rewind = Rewind(self._source.recording)
        return rewind.instant(round(at))

    def _export(self, said: Said) -> bytes:
        """What is seen, as a file: `ports`, `begin_s` and `end_s`, `ending`."""
        stated = (number_in(said, name) for name in ("begin_s", "end_s"))
        begin, end = (round(min(max(each, 0.0), LONGEST_S) * SECOND) for each in stated)
        ports = str(said.get("ports", "")).split()
        ending = str(said.get("ending", ""))
        return exported(self._source.recording, ports, begin, end, ending)

    # Gains ----------------------------------------------------------------------------------------

    def _sliders(self, _said: Said) -> object:
        board = self._source.board
        if not self._source.is_live:
            return sliders(board, retunable_values(board.settings, board.retunable))
        return sliders(board, self._ask("get")["values"])

    def _board_file(self, said: Said) -> bytes:
        """A copy of the board.toml with `values`, an object in JSON."""
        try:
            values = msgspec.json.decode(str(said.get("values", "")), type=dict[str, Any])
        except NOT_JSON as error:
            raise ConfigError.of_one("values", "no object", expected="{KEY: VALUE}") from error
        source = Path(self._source.observed.header.source)
        return board_file(self._source.board, values, source).encode()

    def _try(self, said: Said) -> object:
        return trial(self._source.recording, _values_in(said))

    def _set(self, said: Said) -> object:
        return self._ask("set", values=_values_in(said))

    # Its doubles ----------------------------------------------------------------------------------

    @property
    def _doubles(self) -> Path:
        """Where the doubles of the run are served. Raises ConfigError."""
        state = self._source.state or self._source.look()
        if not self._source.is_live or state.doubles in {None, IN_THE_RUN}:
            fault = "this run is not on doubles that are served"
            raise ConfigError.of_one("break", fault, expected="`play`, or `run --doubles SOCKET`")
        return Path(str(state.doubles))

    def _break(self, said: Said) -> object:
        return strike(self._doubles, *map(said.get, ("kind", "device", "for_s", "amount")))

    # The run's process ----------------------------------------------------------------------------

    def _stall(self, said: Said) -> object:
        stall(self._run, number_in(said, "for_s"))
        return {}

    def _kill(self, _said: Said) -> object:
        kill(self._run)
        return {}


def number_in(said: Said, name: str) -> float:
    """A finite number that was said. Raises ConfigError."""
    value = said.get(name)
    try:
        number = float(value)  # type: ignore[arg-type] # whatever was said
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if isinstance(value, bool) or number - number != 0.0:
        raise ConfigError.of_one(name, repr(value)[:40], expected="a number")
    return number


def _values_in(said: Said) -> dict[str, Any]:
    values = said.get("values")
    if not isinstance(values, dict):
        raise ConfigError.of_one("values", "no object", expected='{"values": {KEY: VALUE}}')
    return values
