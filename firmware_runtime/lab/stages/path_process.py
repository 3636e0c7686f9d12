"""The process of an impaired path: started, asked for its addresses, ended with its counts."""

import json
import subprocess
import sys
from collections.abc import Sequence
from select import select
from typing import Any, Final

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.cut.impairment import Impairment
from firmware_runtime.system.programs import end_within

_PATIENCE_S: Final = 60.0


class PathProcess:
    """An `impaired_path` to the robot's address, with a front and a back socket at `host`.

    Raises ConfigError if it does not start.
    """

    def __init__(self, host: str, robot: str, how: Impairment, before: Sequence[str] = ()) -> None:
        module = "firmware_runtime.links.cut.impaired_path"
        at = f"{host}:0"
        words = [*before, sys.executable, "-m", module, at, at, robot, str(how)]
        self._process = subprocess.Popen(  # noqa: S603 -- this program itself
            words,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            process_group=0,
        )
        self._counts: dict[str, Any] | None = None
        addresses = self._line()
        if not addresses:
            self.end()
            raise ConfigError("impairment", [f"{host}: its process did not start"])
        self.front: str = addresses["front"]
        self.back: str = addresses["back"]

    def end(self) -> dict[str, Any]:
        """End it; what became of the datagrams, by way, or nothing if it was killed."""
        if self._counts is None:
            self._counts = self._end()
        return self._counts

    def _end(self) -> dict[str, Any]:
        assert self._process.stdin is not None  # noqa: S101 -- it was asked for
        assert self._process.stdout is not None  # noqa: S101 -- likewise
        self._process.stdin.close()
        counts = self._line()
        end_within(self._process, _PATIENCE_S)
        self._process.stdout.close()
        return counts

    def _line(self) -> dict[str, Any]:
        """The next line that it prints; empty if there comes none in time."""
        assert self._process.stdout is not None  # noqa: S101 -- it was asked for
        ready, _, _ = select([self._process.stdout], (), (), _PATIENCE_S)
        line = self._process.stdout.readline() if ready else b""
        found: dict[str, Any] = json.loads(line) if line else {}
        return found
