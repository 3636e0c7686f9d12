"""Two threads on one bus double: a transaction is one step, as with a real adapter."""

import sys
import threading
from collections.abc import Iterator

import pytest

from sim_doubles.chips.register_target import RegisterTarget
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

ADDRESS = 0x40
TIMES = 2000


class Numbered(RegisterTarget):
    """Every register reads as its own number."""

    def _read_register(self, register: int) -> int:
        return register

    def _write_register(self, register: int, byte: int) -> None:
        raise AssertionError(register, byte)


@pytest.fixture
def _threads_switch_often() -> Iterator[None]:
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.slow
@pytest.mark.usefixtures("_threads_switch_often")
def test_two_threads_never_read_each_others_bytes() -> None:
    clock = ManualClock()
    bus = I2cBusDouble("i2c-1", clock, [Numbered(clock, ADDRESS)], reach=clock.reach)
    wrong: list[bytes] = []

    def read_from(register: int) -> None:
        expected = bytes(range(register, register + 8))
        for _ in range(TIMES):
            found = bus.write_read(ADDRESS, bytes((register,)), 8)
            if found != expected:
                wrong.append(found)

    threads = [threading.Thread(target=read_from, args=(register,)) for register in (0x10, 0x80)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []
    assert bus.transactions == 2 * TIMES
    assert bus.bytes == 2 * TIMES * 11
