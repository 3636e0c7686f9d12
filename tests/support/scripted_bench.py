"""A model on a scripted chip; what comes, what the chip answers and what was seen are lines.

`50 right=1 left=2` puts values into ports at an instant in ms, `60` runs until then. `drives .x.`
lets the chip answer well, not at all, and well from then on. `pings is 50 150`
compares instants or numbers, `phase is idle` words of the bench; `pings is ()` is none at all.
"""

import ast
import re
from collections.abc import Mapping
from typing import ClassVar, Generic, TypeVar

from firmware_runtime.devs.atomic import Atomic
from tests.support.atomic_bench import AtomicBench
from tests.support.scripted_chip import SILENT, ScriptedChip

C = TypeVar("C", bound=ScriptedChip)
_FIGURE = re.compile(r"(\w+) is (.+)")


class PlayedBench(AtomicBench):
    @property
    def consecutive(self) -> list[int]:
        """The number in its row of each fault."""
        return [fault.consecutive for fault in self.faults]

    @property
    def applied(self) -> str:
        """What an actuator said that it applies, by name."""
        return " ".join(each.name for each in self.values("applied"))

    @property
    def applied_at(self) -> list[float]:
        return [at for at, _ in self.said["applied"]]

    @property
    def phase(self) -> str:
        return self.model.phase

    def play(self, *lines: str) -> None:
        """Carry out the lines; an AssertionError says which of them was not so."""
        for line in "; ".join(lines).split("; "):
            figure = _FIGURE.fullmatch(line)
            if figure:
                found = getattr(self, figure[1])
                seen = (
                    found if isinstance(found, str) else " ".join(f"{each:.12g}" for each in found)
                )
                assert seen == figure[2].replace("()", ""), (line, found)
            elif line[0].isdigit():
                at_ms, *values = line.split()
                named = dict(value.split("=") for value in values)
                if named:
                    self.put(float(at_ms), **{n: self.value(n, v) for n, v in named.items()})
                else:
                    self.run(float(at_ms))
            else:
                self.act(line)

    def act(self, line: str) -> None:
        raise NotImplementedError(line)

    def value(self, port: str, text: str) -> object:
        """What a line has for a port: a number, or the numbers of a tuple of the port's kind."""
        if text.startswith("("):
            return self.model.in_ports[port].type(*map(float, text.strip("()").split(",")))
        return float(text) if text in {"nan", "inf"} else ast.literal_eval(text)


class ScriptedBench(PlayedBench, Generic[C]):
    good: ClassVar[Mapping[str, object]] = {}
    """What a chip answers where that is not nothing."""

    def __init__(self, model: Atomic, chip: C) -> None:
        super().__init__(model)
        self.chip = chip
        chip.now = lambda: self.simulator.now

    @property
    def steps(self) -> list[float]:
        """When a step of the bring-up was taken."""
        return self.chip.times("step")

    def act(self, line: str) -> None:
        kind, answers = line.split()
        script = [SILENT if each == "x" else self.good.get(kind) for each in answers]
        setattr(self.chip, kind, script)
