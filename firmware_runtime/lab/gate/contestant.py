"""One version of the program, or a command, as a process of its own: measures what it costs.

A script, given to Python by its path with the checkout first on the import path, so that it is the
checkout's program that runs. Words: the checkout's folders with packages, a processor, seconds of
robot time, and BOARD or MODULE:CLASS with KEY=VALUE of `--set`, or `--` with a command. With 0
seconds it finds out how many cost enough to be measured. The last line that it prints is a JSON
object.
"""

import json
import os
import resource
import subprocess
import sys
import time
import tomllib
from importlib import import_module
from pathlib import Path
from typing import Any

WARMING_S = 2.0
"""Robot time that is not measured: bring-up, and what is imported late."""
LEAST_NS, LEAST_ACTIVATIONS = 150_000_000, 20
"""Least cost of a stretch, and least count of activations in it."""
SHORTEST_S, LONGEST_S, SLACK_S = 0.1, 1e6, 1e-6


class Contestant:
    """The program in virtual time, opened again whenever its run is over."""

    def __init__(self, word: str, assignments: list[str]) -> None:
        self._word = word
        self._set = dict(_assignment(each) for each in assignments)
        self._activations, self._at_s = 0, 0.0
        self._opened: Any = self._open()

    def stretch(self, span_s: float) -> dict[str, Any]:
        """Run for so long; processor time in ns, and activations."""
        spent = activations = 0
        left_s = span_s
        while left_s > SLACK_S:
            before = time.process_time_ns()
            result = self._opened.run(left_s)
            spent += time.process_time_ns() - before
            activations += result.statistics.run - self._activations
            left_s -= result.at_s - self._at_s
            self._activations, self._at_s = result.statistics.run, result.at_s
            if left_s > SLACK_S:  # the run is over
                if result.at_s < SLACK_S:
                    break
                self._opened.close()
                self._activations, self._at_s = 0, 0.0
                self._opened = self._open()
        return {"span_s": span_s, "ns": max(spent, 1), "activations": activations}

    def long_stretch(self) -> dict[str, object]:
        """The shortest stretch, doubled from the least on, that costs and holds enough."""
        span_s = SHORTEST_S
        while span_s < LONGEST_S:
            found = self.stretch(span_s)
            if found["ns"] >= LEAST_NS and found["activations"] >= LEAST_ACTIVATIONS:
                return found
            span_s *= 2
        sys.exit("nothing happens in it by itself; expected a board or a model that runs")

    def _open(self) -> object:
        front_door = import_module("firmware_runtime")
        if ":" in self._word and not Path(self._word).exists():
            module_name, _, name = self._word.partition(":")
            found = getattr(import_module(module_name), name)
            model = found() if callable(found) else found
            return front_door.open_model(model, clock="virtual")
        return front_door.open_board(self._word, doubles=True, clock="virtual", set=self._set)


def modules_of(folders: set[Path]) -> int:
    """Count modules imported from these folders; not from deeper in them."""
    own = 0
    for name, module in list(sys.modules.items()):
        if file := getattr(module, "__file__", None):
            path = Path(file).resolve()
            depth = name.count(".") + (path.stem == "__init__")
            own += any(place in folders for place in path.parents[depth:][:1])
    return own


def run_of(command: list[str]) -> dict[str, object]:
    """A run of a command: its processor time and that of what it has waited for."""
    status = subprocess.run(command, check=False, stdout=sys.stderr).returncode  # noqa: S603
    if status != 0:
        sys.exit(f"it ended with {status}; expected a command that ends with 0")
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    ns = max(round((spent.ru_utime + spent.ru_stime) * 1e9), 1)
    return {"span_s": 1.0, "ns": ns, "activations": 0, "used": 1}


def _assignment(text: str) -> tuple[str, object]:
    key, _, value = text.partition("=")
    try:
        return key.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key.strip(), value.strip()


def main(folders: str, cpu: str, seconds: str, *words: str) -> dict[str, object]:
    """Measure."""
    os.sched_setaffinity(0, {int(cpu)})
    word, *rest = words
    if word == "--":
        return run_of(rest)
    contestant = Contestant(word, rest)
    contestant.stretch(WARMING_S)
    found = contestant.stretch(float(seconds)) if float(seconds) else contestant.long_stretch()
    own = {Path(each).resolve() for each in folders.split(os.pathsep)}
    return {**found, "used": modules_of(own)}


if __name__ == "__main__":
    sys.stdout.write(f"{json.dumps(main(*sys.argv[1:]))}\n")
