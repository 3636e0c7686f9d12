"""One version of the program, as a process of its own: runs stretches of virtual time on request.

It is a script, given to Python by its path with the checkout first on the import path, so that it
is the checkout's program that runs; of that it uses the front door only, whatever version it is.
Words: BOARD|MODULE:CLASS, the checkout's folder, KEY=VALUE of `--set`. It answers a line of JSON to
each line of its standard input, the first one unasked, and ends when that is closed. What the
program prints goes to standard error.

The cost of a stretch is the processor time of this process, less that of a stretch of 1 ns: what a
call of `run` costs in itself is no step's.
"""

import json
import os
import sys
import time
import tomllib
from importlib import import_module
from pathlib import Path
from typing import Any

EMPTY_S = 1e-9
EMPTY_CALLS = 5
SLACK_S = 1e-6
"""A run that ends so much before the instant it was to reach is over."""


class Contestant:
    """The program, opened again whenever its run is over."""

    def __init__(self, word: str, assignments: list[str]) -> None:
        self._word = word
        self._set = dict(_assignment(each) for each in assignments)
        self._empty_ns: int | None = None
        self._activations = 0
        self._until_s = 0.0
        self._open()

    def stretch(self, span_s: float) -> dict[str, Any]:
        """Run for so long; what it cost, what happened in it, and whether it was the run's last."""
        if self._empty_ns is None:
            calls = [self._timed(EMPTY_S)[0] for _ in range(EMPTY_CALLS)]
            self._empty_ns = min(calls)
        before = self._activations
        cost_ns, result = self._timed(span_s)
        self._activations = result.statistics.run
        activations = self._activations - before
        is_over = result.at_s < self._until_s - SLACK_S
        if is_over:
            self.begin_again()
        own_ns = max(cost_ns - self._empty_ns, 1)
        return {"ns": own_ns, "activations": activations, "is_over": is_over}

    def begin_again(self) -> dict[str, Any]:
        """Close the run and open another, at the first instant."""
        self._opened.close()
        self._activations = 0
        self._until_s = 0.0
        self._open()
        return {}

    def used(self, folder: Path) -> int:
        """How many modules were imported from the checkout, or its `src`.

        What lies deeper in it is not its own, such as an environment or another checkout.
        """
        places = (folder, folder / "src")
        return sum(
            _imported_as(Path(file).resolve()) == place.joinpath(*name.split("."))
            for name, module in list(sys.modules.items())
            if (file := getattr(module, "__file__", None))
            for place in places
        )

    def _open(self) -> None:
        front_door = import_module("firmware_runtime")
        if ":" in self._word and not Path(self._word).exists():
            module_name, _, name = self._word.partition(":")
            found = getattr(import_module(module_name), name)
            model = found() if callable(found) else found
            self._opened = front_door.open_model(model, clock="virtual")
        else:
            self._opened = front_door.open_board(
                self._word, doubles=True, clock="virtual", set=self._set
            )

    def _timed(self, span_s: float) -> tuple[int, Any]:
        self._until_s += span_s
        began = time.process_time_ns()
        result = self._opened.run(span_s)
        return time.process_time_ns() - began, result


def _assignment(text: str) -> tuple[str, object]:
    key, _, value = text.partition("=")
    try:
        return key.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key.strip(), value.strip()


def _imported_as(file: Path) -> Path:
    """A module's file without its ending; of a package its folder."""
    return file.parent if file.stem == "__init__" else file.with_name(file.name.partition(".")[0])


def main() -> None:
    """Answer until standard input is closed."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    word, folder, *assignments = sys.argv[1:]
    contestant = Contestant(word, assignments)
    answer: dict[str, Any] = {"used": contestant.used(Path(folder).resolve())}
    while True:
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
        line = sys.stdin.readline()
        if not line:
            return
        asked = json.loads(line)
        if "cpu" in asked and hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(0, {asked["cpu"]})
        answer = (
            contestant.stretch(asked["span_s"]) if "span_s" in asked else contestant.begin_again()
        )


if __name__ == "__main__":
    main()
