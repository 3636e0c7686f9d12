"""`run MODULE:CLASS`: any DEVS model, at once, in virtual time."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import seconds

Command = Callable[..., Any]
HERE = __name__


class Ramp(Atomic):
    """Sends a value that grows, again and again, from what was last put in."""

    def __init__(self, name: str, period_s: float, *, step: float = 1.0) -> None:
        super().__init__(name)
        self.level = self.out_port("level", float)
        self.start = self.in_port("start", float)
        self._period = seconds(period_s)
        self._step = step
        self._at = 0.0

    def initialize(self) -> None:
        """Begin."""
        self.hold_in("rising", self._period)

    def output(self) -> None:
        """Send."""
        self.level.send(self._at)

    def internal(self) -> None:
        """Rise."""
        self._at += self._step
        self.hold_in("rising", self._period)

    def external(self, elapsed: int) -> None:
        """Go on from there."""
        self._at = self.start[-1]
        self.continue_(elapsed)


def two_ramps() -> Coupled:
    """Two of them, which send nothing outside."""
    model = Coupled("ramps")
    model.add(Ramp("slow", 1.0))
    model.add(Ramp("quick", 0.5))
    return model


ONE = Ramp("one", 2.0)


def sent(out: str) -> list[str]:
    return [line for line in out.splitlines() if line.startswith("00:00:")]


def test_a_class_is_made_with_arguments_and_runs_at_once(command: Command) -> None:
    words = ("--set", "period_s=0.5", "--set", "step=2", "--for", "1")
    ended = command("run", f"{HERE}:Ramp", *words)
    assert (ended.status, ended.error) == (0, "")
    assert sent(ended.out) == ["00:00:00:500 level 0", "00:00:01:000 level 2"]
    assert "ramp" in ended.out  # its class's name, in the statistics


def test_a_function_or_a_model_will_do_and_ten_seconds_are_run(
    command: Command, tmp_path: Path
) -> None:
    trace = tmp_path / "trace.jsonl"
    assert command("run", f"{HERE}:two_ramps", "--trace", trace).status == 0
    ports = [json.loads(line)["port"] for line in trace.read_text().splitlines()]
    assert (ports.count("slow.level"), ports.count("quick.level")) == (10, 20)
    document = json.loads(command("run", f"{HERE}:ONE", "--json").out)
    assert document["clock"] == "virtual"
    assert len(document["result"]["outputs"]) == 5


def test_values_are_put_in_as_into_a_robot(command: Command, tmp_path: Path) -> None:
    words = ("--set", "period_s=1", "--for", "3", "--input", "1.5:start=10")
    outputs = tmp_path / "out.txt"
    assert command("run", f"{HERE}:Ramp", *words, "--outputs", outputs).status == 0
    assert sent(outputs.read_text())[1:] == ["00:00:02:000 level 10", "00:00:03:000 level 11"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("Ramp",), "period_s: not stated; expected --set period_s=VALUE"),
        (("Ramp", "--set", "perod_s=1"), "did you mean period_s?"),
        (("Ramp", "--set", "period_s"), "expected NAME=VALUE"),
        (("ONE", "--set", "period_s=1"), "it is a model already"),
        (("ONE", "--arm"), "leave --arm out"),
        (("ONE", "--plot", "x.svg"), "--plot: has no effect"),
        (("ONE", "--input", "1:stop=1"), "no such input port"),
        (("Ram",), "did you mean Ramp?"),
    ],
)
def test_what_cannot_be_run_is_a_sentence(
    command: Command, words: tuple[str, ...], sentence: str
) -> None:
    ended = command("run", f"{HERE}:{words[0]}", *words[1:])
    assert (ended.status, ended.out) == (2, "")
    assert sentence in ended.error
