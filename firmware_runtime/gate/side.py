"""One version of the program in a process of its own, that runs stretches on request.

It is in a process group of its own: Ctrl-C is for the verb, which ends it. If the verb is killed,
its standard input is closed and it ends by itself.
"""

import json
import os
import re
import select
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from msgspec import Struct, convert

from firmware_runtime.closing import Closing
from firmware_runtime.errors import ConfigError
from firmware_runtime.gate.checkouts import Checkout
from firmware_runtime.gate.surroundings import environment

LONGEST_S = 300.0
"""A stretch that takes longer, or a start, is given up."""
_OUR_CLASS = re.compile(r"^firmware_runtime[\w.]*: ")
_CONTESTANT = Path(__file__).with_name("contestant.py")


class Stretch(Struct, frozen=True):
    """What a stretch of virtual time cost in processor time, ns, and what happened in it."""

    ns: int
    activations: int
    is_over: bool


class Side(Closing):
    """The process, which `close` ends. It starts at once, and is ready after `wait`."""

    def __init__(self, checkout: Checkout, word: str, assignments: list[str]) -> None:
        self.checkout = checkout
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 -- closed with the process
        self._process = subprocess.Popen(  # noqa: S603 -- this interpreter
            [sys.executable, "-P", str(_CONTESTANT), word, str(checkout.folder), *assignments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            cwd=checkout.folder,
            env=environment(checkout),
            start_new_session=True,
        )

    def close(self) -> None:
        """End it."""
        self._process.kill()
        self._process.communicate()
        self._errors.close()

    def wait(self) -> int:
        """Wait until it is ready; returns how many modules are the checkout's own."""
        used: int = self._answer()["used"]
        return used

    def stretch(self, cpu: int, span_s: float) -> Stretch:
        """Run for so long on one processor. Raises ConfigError when it cannot."""
        self._ask({"cpu": cpu, "span_s": span_s})
        return convert(self._answer(), Stretch)

    def begin_again(self) -> None:
        """Let its run be another, at the first instant."""
        self._ask({})
        self._answer()

    # ---------------------------------------------------------------------------------------------

    def _ask(self, question: dict[str, Any]) -> None:
        assert self._process.stdin is not None  # noqa: S101 -- a pipe, as asked for
        try:
            self._process.stdin.write(json.dumps(question).encode() + b"\n")
            self._process.stdin.flush()
        except BrokenPipeError as error:
            raise self._failure("it ended") from error

    def _answer(self) -> dict[str, Any]:
        output = self._process.stdout
        assert output is not None  # noqa: S101 -- a pipe, as asked for
        if not select.select([output], [], [], LONGEST_S)[0]:
            raise self._failure(f"no answer in {LONGEST_S:g} s")
        line = output.readline()
        if not line:
            self._process.wait()
            raise self._failure("it ended")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _failure(self, otherwise: str) -> ConfigError:
        """What it said last, as the sentence of why it is not measured."""
        self._errors.seek(0, os.SEEK_SET)
        said = self._errors.read().decode(errors="replace")
        what = last_error(said) or otherwise
        where = f"{self.checkout.name} {self.checkout.stated}"
        return ConfigError.of_one(where, f"{what}; expected a program that runs")


def last_error(said: str) -> str:
    """The last error of what Python printed, in a line: what is indented belongs to it."""
    lines = said.rstrip().splitlines()
    begins = max((at for at, line in enumerate(lines) if not line.startswith(" ")), default=0)
    return _OUR_CLASS.sub("", " ".join(line.strip() for line in lines[begins:]))
