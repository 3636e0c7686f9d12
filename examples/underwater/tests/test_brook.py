"""Driver and model against the double: sweep, silence, noise, and another program."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from serial import Serial
from underwater.brook.double import BrookDouble
from underwater.brook.driver import BAUD, Brook, FrameDecoder
from underwater.brook.meter import Meter

from firmware_runtime import MILLISECOND, NEVER, Simulator
from firmware_runtime.hal.strike import Span
from sim_doubles.serial_line import SerialLineDouble

PERIOD = 100 * MILLISECOND


class Bench:
    """One meter in virtual time, on the double of its device."""

    def __init__(self) -> None:
        self.at, self.flow_l_s = 0, 0.25
        self.double = BrookDouble(lambda: self.at, lambda _: self.flow_l_s)
        self.port = SerialLineDouble("meter", lambda: self.at, self.double)
        meter = Meter("meter", Brook(self.port), PERIOD)
        self.simulator = Simulator(meter, checked=True)
        self.flows: list[tuple[int, float]] = []
        self.faults: list[str] = []
        self.simulator.listen(meter.flow_out, lambda at, value: self.flows.append((at, value)))
        self.simulator.listen(meter.fault_out, lambda _, fault: self.faults.append(fault.reason))
        self.simulator.run(0)

    def run_for(self, milliseconds: int) -> None:
        for _ in range(milliseconds):
            self.at += MILLISECOND
            self.simulator.run(self.at)


@pytest.mark.parametrize("flow_l_s", [0.0, 0.001, 1.5, 65.535])
def test_the_flow_comes_every_period(flow_l_s: float) -> None:
    bench = Bench()
    bench.flow_l_s = flow_l_s
    bench.run_for(1000)
    instants = [at for at, _ in bench.flows]
    assert {later - at for at, later in pairwise(instants)} == {PERIOD}
    assert bench.flows[-1][1] == pytest.approx(flow_l_s, abs=0.0005)
    assert (bench.faults, bench.double.warnings) == ([], [])


def test_a_line_that_was_cut_is_a_fault_and_no_old_flow() -> None:
    bench = Bench()
    bench.run_for(300)
    bench.port.cut()
    count = len(bench.flows)
    bench.run_for(300)
    assert len(bench.flows) == count
    assert "nothing arrived" in bench.faults[-1]
    bench.port.reconnect()
    bench.run_for(300)
    assert len(bench.flows) > count


@pytest.mark.parametrize("cut", range(12))
def test_frames_are_found_in_noise_wherever_they_are_cut(cut: int) -> None:
    stream = bytes.fromhex("3a 00 3a 46 00 fa bf 00 3a 49 42 52")
    decoder = FrameDecoder()
    assert decoder.feed(stream[:cut]) + decoder.feed(stream[cut:]) == [(0x46, 250)]


def test_another_program_reads_the_double(serial_double: Callable[..., Any]) -> None:
    with Serial(serial_double("brook").path, BAUD, timeout=5) as port:
        port.write(bytes.fromhex("3a 46 b9"))
        assert port.read(5) == bytes.fromhex("3a 46 00 fa bf")


def test_a_meter_that_lies_shows_twice_the_flow_until_it_is_well_again() -> None:
    bench = Bench()
    bench.run_for(300)
    bench.port.strike("scale", None, Span(bench.at, NEVER, once=False), 0.0)
    bench.run_for(300)
    assert bench.flows[-1][1] == pytest.approx(0.5)
    bench.port.clear_strikes()
    bench.run_for(200)
    assert bench.flows[-1][1] == pytest.approx(0.25)
    assert bench.faults == []
