"""A clock, and a target that writes down what it sees on the wire."""

from collections.abc import Callable

import pytest

from sim_doubles.clock import ManualClock
from sim_doubles.i2c_target import Target


class WireRecorder(Target):
    """Answers one address, refuses the bytes in `refuses`, gives `answers` in a circle."""

    def __init__(self, address: int, answers: bytes = b"\xff", refuses: bytes = b"") -> None:
        self.address = address
        self.answers = answers
        self.refuses = refuses
        self.seen: list[str] = []

    def start(self, address: int, *, read: bool) -> bool:
        if address != self.address:
            return False
        self.seen.append("R" if read else "W")
        return True

    def write(self, byte: int) -> bool:
        accepted = byte not in self.refuses
        self.seen.append(f"{byte:02x}" if accepted else f"{byte:02x}!")
        return accepted

    def read(self) -> int:
        byte, self.answers = self.answers[0], self.answers[1:] + self.answers[:1]
        self.seen.append("r")
        return byte

    def stop(self) -> None:
        self.seen.append("P")

    def power_cycle(self) -> None:
        self.seen.append("power")


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


@pytest.fixture
def recorder() -> Callable[..., WireRecorder]:
    return WireRecorder
