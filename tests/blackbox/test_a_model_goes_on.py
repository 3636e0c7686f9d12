"""A small network without hardware: set back in the middle, it goes on to the bit."""

import os
import random
import subprocess
import sys
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.pid import Pid, PidGains
from firmware_runtime.recording.blackbox.state.keyframes import StateTable

Trace: TypeAlias = list[tuple[int, str, object]]


class Noise(Atomic):
    """Sends a rate at random instants; its generators and a closure are its state."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.rate = self.out_port("rate", float)
        self._random = random.Random(14)  # noqa: S311 -- to be repeated
        self._normal = np.random.default_rng(14)
        self._count = 0
        self._draw = self._drawing()

    def initialize(self) -> None:
        self.hold_in("sending", 0)

    def output(self) -> None:
        self.rate.send(self._draw())

    def internal(self) -> None:
        self._count += 1
        self.hold_in(f"round {self._count}", self._random.randrange(1, 5) * MILLISECOND)

    def _drawing(self) -> Callable[[], float]:
        drawn = 0.0

        def draw() -> float:
            nonlocal drawn
            drawn = 0.9 * drawn + self._random.gauss(0.0, 1.0)
            return drawn

        return draw


class Plant(Atomic):
    """Integrates rates and commands; measures with a delay of some samples."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.rate = self.in_port("rate", float)
        self.command = self.in_port("command", float)
        self.motion = self.out_port("motion", Motion)
        self._state = np.zeros(2)
        self._transition = np.array([[1.0, 0.002], [0.0, 0.997]])
        self._delayed = deque([Motion(0.0, 0.0)] * 3, 3)
        self._seen: dict[str, set[int]] = {"signs": set()}
        self._remember = self._delayed.append

    def initialize(self) -> None:
        self.hold_in("measuring", 2 * MILLISECOND)

    def output(self) -> None:
        self.motion.send(self._delayed[0])

    def internal(self) -> None:
        self._state = self._transition @ self._state
        angle, rate = (float(each) for each in self._state)
        self._remember(Motion(angle, rate))
        self._seen["signs"].add(int(np.sign(rate)))
        self.hold_in("measuring", 2 * MILLISECOND)

    def external(self, elapsed: int) -> None:
        for value in (*self.rate, *self.command):
            self._state[1] += 0.01 * value
        self.continue_(elapsed)


class Loop(Coupled):
    def __init__(self) -> None:
        super().__init__("loop")
        noise, plant = self.add(Noise("noise")), self.add(Plant("plant"))
        pid = self.add(Pid("pid", PidGains(4.0, 2.0, 0.5, 3.0), 0.25))
        self.couple(noise.rate, plant.rate)
        self.couple(plant.motion, pid.measurement)
        self.couple(pid.command, plant.command)


class Run:
    """A simulation of the loop, with what its models sent."""

    def __init__(self) -> None:
        self.sent: Trace = []
        self.simulator = Simulator(Loop())
        for atomic in self.simulator.atomics:
            for port in atomic.out_ports.values():
                self.simulator.listen(port, partial(self._take_down, port.path))
        roots = {"model": self.simulator.root, "simulator": self.simulator}
        self.table = StateTable(roots, [self])

    def _take_down(self, path: str, now: int, value: object) -> None:
        self.sent.append((now, path, value))

    def to(self, at: int) -> bytes:
        self.simulator.run(at)
        return self.table.capture()


@pytest.mark.parametrize("begins_ms", [1, 7, 100, 333])
def test_it_goes_on_to_the_bit(begins_ms: int) -> None:
    whole, part = Run(), Run()
    state = whole.to(begins_ms * MILLISECOND)
    whole.sent.clear()
    end = whole.to(500 * MILLISECOND)
    part.table.restore(state)
    assert part.to(500 * MILLISECOND) != b""
    assert len(whole.sent) > 100
    assert repr(part.sent) == repr(whole.sent)
    assert list(part.table.differences(end)) == []


def test_one_that_has_run_on_goes_back_and_does_the_same_again() -> None:
    run = Run()
    state = run.to(50 * MILLISECOND)
    run.sent.clear()
    run.to(300 * MILLISECOND)
    once = repr(run.sent)
    run.table.restore(state)
    run.sent.clear()
    run.to(300 * MILLISECOND)
    assert repr(run.sent) == once


@pytest.fixture(name="written", scope="module")
def _written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("states") / "loop.state"
    path.write_bytes(Run().to(40 * MILLISECOND))
    return path


@pytest.mark.slow
@pytest.mark.parametrize("seed", ["0", "1", "12345"])
def test_another_process_takes_it_up(seed: str, written: Path) -> None:
    """Whatever order its sets and hashes have."""
    program = (
        "import sys; from pathlib import Path; from tests.blackbox.test_a_model_goes_on import Run;"
        "run = Run(); run.table.restore(Path(sys.argv[1]).read_bytes());"
        "run.to(60_000_000); print(repr(run.sent))"
    )
    here = Run()
    here.table.restore(written.read_bytes())
    here.to(60 * MILLISECOND)
    answer = subprocess.run(
        [sys.executable, "-c", program, str(written)],
        env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": "."},
        capture_output=True,
        text=True,
        check=True,
    )
    assert len(here.sent) > 10
    assert answer.stdout.strip() == repr(here.sent)
