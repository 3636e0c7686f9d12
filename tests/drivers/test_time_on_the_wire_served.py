"""The same on doubles behind a real socket, in real time, on a bus slow enough for any machine."""

import os
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import TypeAlias, cast

import pytest

from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.executive.clocks import MonotonicClock, OutsideClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.hal.served.client import ServedBus
from firmware_runtime.hal.served.connection import Connection
from firmware_runtime.hal.wire_errors import Fault
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.rigs.board_rig import DoublesRig
from sim_doubles.served.logs import OutputLog
from sim_doubles.served.server import DoublesServer, RealClock
from sim_doubles.served.service import DoublesService
from tests.support.adc import READING, Adc, AdcDouble, HastySampler, PatientSampler, Sampler
from tests.support.waiting import PATIENCE_S

BUS_HZ = 400
"""The command that starts a conversion takes 95 ms."""

Kind: TypeAlias = type[Sampler]


class AdcBench:
    """One converter on one bus; no output, no world."""

    def __init__(self, clock: RealClock) -> None:
        double = I2cBusDouble("i2c1", clock, [AdcDouble(clock)], bus_hz=BUS_HZ, reach=clock.reach)
        self.buses = {"i2c1": double}

    def catch_up(self) -> None:
        pass

    def levels(self, _at: int) -> dict[str, float]:
        return {}

    def next_change_at(self, _at: int) -> int:
        return NEVER


@pytest.fixture
def path(tmp_path: Path) -> Iterator[Path]:
    """Where a converter is served, by a thread."""
    socket, clock = tmp_path / "adc.sock", RealClock()
    bench = cast("DoublesRig", AdcBench(clock))
    with (
        OutputLog(Path(os.devnull), bench) as log,
        DoublesServer(socket, DoublesService("adc", bench, clock, log), log, clock) as server,
    ):
        thread = threading.Thread(target=server.serve)
        thread.start()
        yield socket
        server.stop()
        thread.join()


def run(kind: Kind, path: Path, until: int) -> list[object]:
    """Readings and faults of a sampler."""
    said: list[object] = []
    clock = MonotonicClock()
    world = OutsideClock(clock.now)
    connection = Connection(path, answer_s=PATIENCE_S)
    model = kind(Adc(AccountedBus(ServedBus("i2c1", connection.ask), BUS_HZ, time=world)))
    executive = Executive(model, clock, list, world_now=world)
    executive.simulator.listen(model.reading_out, lambda _, value: said.append(value))
    executive.simulator.listen(model.fault_out, lambda _, value: said.append(value))
    assert executive.run(until).error is None
    connection.close()
    return said


@pytest.mark.slow
def test_a_model_that_counts_from_its_activation_gets_faults(path: Path) -> None:
    said = run(HastySampler, path, 200 * MILLISECOND)
    faults = [value for value in said if isinstance(value, Fault)]
    assert len(faults) > 9 * (len(said) - len(faults))


@pytest.mark.slow
def test_one_that_counts_from_the_end_of_the_transfer_gets_samples_only(path: Path) -> None:
    said = run(PatientSampler, path, 700 * MILLISECOND)
    assert len(said) > 0
    assert set(said) == {READING}
