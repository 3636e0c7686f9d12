import pytest
from firmware_drivers.chips.pca9685 import Pca9685, software_reset

from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

ALL_CALL = 0x70


class Bench:
    """One chip on a bus; remembers whether any output was ever on."""

    def __init__(self, true_osc_hz: float = 25e6) -> None:
        self.clock = ManualClock()
        self.double = Pca9685Double(self.clock, true_osc_hz=true_osc_hz)
        self.bus = I2cBusDouble("i2c-1", self.clock, [self.double])

    def bring_up(self, frequency_hz: float = 1000, osc_hz: float = 25e6) -> Pca9685:
        chip = Pca9685(self.bus, osc_hz=osc_hz)
        for step in chip.bring_up(frequency_hz):
            step.action()
            self.clock.advance(step.wait_ns)
        return chip


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.mark.parametrize(
    ("frequency_hz", "osc_hz"),
    [(24, 25e6), (1526, 25e6), (24, 24e6), (1400, 24e6), (50, 26.2e6), (1000, 26.2e6)],
)
def test_the_rate_the_driver_states_is_the_rate_of_a_chip_so_calibrated(
    frequency_hz: float, osc_hz: float
) -> None:
    bench = Bench(osc_hz)
    chip = bench.bring_up(frequency_hz, osc_hz)
    assert bench.double.frequency_hz == pytest.approx(chip.frequency_hz)
    assert bench.double.running


def test_after_bring_up_the_chip_runs_with_all_outputs_off(bench: Bench) -> None:
    bench.bring_up()
    assert bench.double.running
    assert bench.double.all_off


def test_all_call_is_answered_at_power_up_and_never_again(bench: Bench) -> None:
    bench.bus.write(ALL_CALL, b"\x00\x11")
    bench.bring_up()
    with pytest.raises(NoAcknowledge):
        bench.bus.write(ALL_CALL, b"\x00\x51")


@pytest.mark.parametrize(
    "left_as",
    [
        "running",
        "asleep with a RESTART due",
        "asleep, duties set",
        "inverted",
        "waiting for four registers",
    ],
)
def test_whatever_a_dead_program_left_no_output_goes_on_in_bring_up(
    bench: Bench, left_as: str
) -> None:
    bench.bring_up().set_duties(0, (0.9,) * 16)
    if left_as == "asleep with a RESTART due":
        bench.bus.write(0x40, b"\x00\x30")
    elif left_as == "asleep, duties set":
        bench.bus.write(0x40, b"\x00\x30")
        bench.bus.write(0x40, b"\x06\x00\x00\x00\x08")
    elif left_as == "inverted":
        bench.bus.write(0x40, b"\x01\x14")
    elif left_as == "waiting for four registers":
        bench.bus.write(0x40, b"\x01\x0c")
    chip = Pca9685(bench.bus)
    wait, *steps = chip.bring_up(50)
    bench.clock.advance(wait.wait_ns)
    for step in steps:
        step.action()
        assert bench.double.all_off, step.name
        bench.clock.advance(step.wait_ns)
    chip.set_duties(0, (0.9,))
    assert bench.double.duties == (3686 / 4096, *(0.0,) * 15)


def test_a_latched_external_clock_needs_a_software_reset(bench: Bench) -> None:
    bench.bus.write(0x40, b"\x00\x10")
    bench.bus.write(0x40, b"\x00\x50")
    with pytest.raises(NotReady, match="EXTCLK is latched"):
        bench.bring_up()
    software_reset(bench.bus)
    bench.bring_up()
    assert bench.double.running


def test_stop_all_stops_all_sixteen_and_duties_can_be_set_again(bench: Bench) -> None:
    chip = bench.bring_up()
    chip.set_duties(0, (0.7,) * 16)
    chip.stop_all()
    assert bench.double.all_off
    assert bench.double.running
    chip.set_duties(0, (0.7,))
    assert bench.double.duties == (2867 / 4096, *(0.0,) * 15)


@pytest.mark.parametrize("mode2", [0x14, 0x0C, 0x1F])
def test_stop_all_stops_what_is_inverted_or_waits_for_four_registers(
    bench: Bench, mode2: int
) -> None:
    chip = bench.bring_up()
    chip.set_duties(0, (0.7,) * 8)
    bench.bus.write(0x40, bytes((0x01, mode2)))
    bench.bus.write(0x40, b"\xfd\x10")
    assert not bench.double.all_off
    assert f"MODE2 reads {mode2:02x}, so full-off may be on" in str(chip.still_on())
    chip.stop_all()
    assert bench.double.all_off
    assert chip.still_on() is None


def test_staggered_outputs_have_the_same_duties(bench: Bench) -> None:
    bench.bring_up()
    chip = Pca9685(bench.bus, staggered=True)
    for step in chip.bring_up(1000):
        step.action()
        bench.clock.advance(step.wait_ns)
    wanted = [channel / 15 for channel in range(16)]
    assert chip.set_duties(0, wanted) == bench.double.duties
    assert bench.double.duties == pytest.approx(wanted, abs=1 / 8192)


def test_a_burst_after_a_brown_out_is_acknowledged_and_does_nothing_which_a_poll_shows(
    bench: Bench,
) -> None:
    chip = bench.bring_up()
    chip.poll()
    bench.double.power_cycle()
    assert chip.set_duties(0, (0.5,) * 8) == (0.5,) * 8
    assert bench.double.all_off
    with pytest.raises(NotReady, match="read 11 11 1e, expected 20 04 05; it was reset"):
        chip.poll()
    with pytest.raises(NotReady):
        chip.set_duties(0, (0.5,) * 8)


def test_a_rate_that_another_program_has_set_is_found_by_a_poll_and_cured_by_bring_up(
    bench: Bench,
) -> None:
    chip = bench.bring_up()
    rate = bench.double.frequency_hz
    for register, value in ((0x00, 0x30), (0xFE, 0x79), (0x00, 0x20)):
        bench.bus.write(0x40, bytes((register, value)))
    assert bench.double.frequency_hz < rate / 2
    with pytest.raises(NotReady, match="read 20 04 79, expected 20 04 05; it was reset or written"):
        chip.poll()
    with pytest.raises(NotReady):
        chip.set_duties(0, (0.5,))
    bench.bring_up()
    assert bench.double.frequency_hz == rate


@pytest.mark.parametrize("mode2", [0x14, 0x0C, 0x05])
def test_mode2_as_another_program_set_it_is_found_by_a_poll_and_cured_by_bring_up(
    bench: Bench, mode2: int
) -> None:
    chip = bench.bring_up()
    bench.bus.write(0x40, bytes((0x01, mode2)))
    with pytest.raises(NotReady, match=f"read 20 {mode2:02x} 05, expected 20 04 05; it was"):
        chip.poll()
    with pytest.raises(NotReady):
        chip.set_duties(0, (0.5,))
    chip = bench.bring_up()
    chip.set_duties(0, (0.25,))
    chip.poll()
    assert bench.double.duties == (0.25, *(0.0,) * 15)


def test_a_brown_out_is_found_by_verify_and_cured_by_bring_up(bench: Bench) -> None:
    chip = bench.bring_up()
    chip.set_duties(0, (0.5,))
    bench.double.power_cycle()
    with pytest.raises(NotReady, match="read 11 11 1e, expected 20 04 05"):
        chip.verify()
    with pytest.raises(NotReady):
        chip.set_duties(0, (0.5,))
    bench.bring_up().set_duties(0, (0.5,))
    assert bench.double.duty(0) == 0.5


def test_what_is_on_is_read_back_by_a_process_that_comes_later(bench: Bench) -> None:
    chip, later = bench.bring_up(), Pca9685(bench.bus)
    assert later.still_on() is None
    chip.set_duties(3, (0.25, 0.0, 1.0))
    assert later.still_on() == "PCA9685 at 0x40 on i2c-1: outputs 3, 5 are on"
    later.stop_all()
    assert later.still_on() is None


def test_a_chip_that_does_not_count_registers_up_is_read_channel_by_channel(bench: Bench) -> None:
    chip = Pca9685(bench.bus)
    assert chip.still_on() is None  # as after power-up
    bench.bus.write(0x40, b"\x01\x14")
    assert "MODE2 reads 14" in str(chip.still_on())
    bench.bus.write(0x40, b"\x01\x04")
    bench.bus.write(0x40, b"\x09\x00")  # LED0_OFF_H
    assert chip.still_on() == "PCA9685 at 0x40 on i2c-1: outputs 0 are on"
