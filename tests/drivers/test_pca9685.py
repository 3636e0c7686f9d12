"""The PCA9685's driver on its double: bytes, rates, duties, and what other programs leave."""

import math

import pytest
from firmware_drivers.chips.pca9685 import Pca9685, software_reset
from firmware_drivers.chips.pca9685_registers import actual_frequency_hz, duty_burst, prescale_for
from firmware_drivers.chips.step import duration_ns
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.budget import bits, wire_bytes
from firmware_runtime.hal.wire_errors import NotReady, WrongDevice
from sim_doubles.faults import FaultScript, ForcedRegister
from tests.support.bare_chip import RegisterBus
from tests.support.wired_pca9685 import DrivenPca9685

OFF, RUNNING = "all_off is True", "running is True"
STOP = ["W 01 04", "W fd 10"]


@pytest.fixture
def rig() -> DrivenPca9685:
    return DrivenPca9685()


@pytest.fixture
def driver(rig: DrivenPca9685) -> Pca9685:
    """Return the rig's, brought up at 1 kHz."""
    return rig.bring_up()


def refuses_duties(driver: Pca9685, reason: str = "duties before bring-up") -> None:
    with pytest.raises(NotReady, match=reason):
        driver.set_duties(0, (0.5,) * 8)


# Rates --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("frequency_hz", "osc_hz", "prescale", "actual_hz"),
    [
        (1526, 25e6, 3, 1525.88),
        (1000, 25e6, 5, 1017.25),
        (400, 25e6, 14, 406.90),
        (200, 25e6, 30, 196.89),
        (100, 25e6, 60, 100.06),
        (50, 25e6, 121, 50.03),
        (24, 25e6, 253, 24.03),
        (50, 26.2e6, 127, 49.97),
    ],
)
def test_prescale_is_the_rounded_one(
    frequency_hz: float, osc_hz: float, prescale: int, actual_hz: float
) -> None:
    assert prescale_for(frequency_hz, osc_hz) == prescale
    assert actual_frequency_hz(prescale, osc_hz) == pytest.approx(actual_hz, abs=0.005)


@pytest.mark.parametrize(
    ("frequency_hz", "osc_hz", "fault"),
    [
        *(
            (rate, 25e6, r"PCA9685 frequency: .* Hz; expected 24 to 1526 Hz")
            for rate in (23.9, 1527, 1600, 0, -50, math.inf, math.nan)
        ),
        (24, 27e6, r"24 Hz; expected 25\.\d to 1\d+\.\d Hz"),
        *((50, osc_hz, "expected 20e6 to 30e6") for osc_hz in (25, 0.0, math.nan, 50e6)),
    ],
)
def test_a_rate_or_an_oscillator_that_cannot_be_is_refused_before_anything_is_sent(
    frequency_hz: float, osc_hz: float, fault: str
) -> None:
    bus = RegisterBus()
    with pytest.raises(SettingError, match=fault):
        Pca9685(bus, osc_hz=osc_hz).bring_up(frequency_hz)
    assert bus.wire == []


@given(st.floats(24.1, 1525), st.floats(24.9e6, 25.1e6))
def test_no_other_prescale_divides_the_oscillator_closer(
    frequency_hz: float, osc_hz: float
) -> None:
    wanted = osc_hz / (4096 * frequency_hz)
    assert abs(prescale_for(frequency_hz, osc_hz) + 1 - wanted) <= 0.5 + 1e-9


@pytest.mark.parametrize(
    ("frequency_hz", "osc_hz"),
    [(24, 25e6), (1526, 25e6), (24, 24e6), (1400, 24e6), (50, 26.2e6), (1000, 26.2e6)],
)
def test_the_rate_the_driver_states_is_the_rate_of_a_chip_so_calibrated(
    frequency_hz: float, osc_hz: float
) -> None:
    rig = DrivenPca9685(osc_hz)
    stated = rig.bring_up(frequency_hz).frequency_hz
    assert rig.chip.frequency_hz == pytest.approx(stated)
    rig.play(RUNNING, OFF)


# Bring-up and after -------------------------------------------------------------------------------


def test_bring_up_stops_the_outputs_first_sets_the_rate_asleep_and_wakes(
    rig: DrivenPca9685,
) -> None:
    rig.play("0x70 W 00 11")  # all-call, answered until then
    wait, silence, *others = rig.driver.bring_up(50)
    rig.sent()
    rig.take([wait])
    assert rig.sent() == []
    silence.action()
    assert rig.sent() == [*STOP, "W 00 20"]
    assert silence.wait_ns > 1e9 / 23.84
    rig.clock.advance(silence.wait_ns)
    rig.take(others)
    assert [each for each in rig.sent() if "R" not in each] == ["W 00 30", "W fe 79", "W 00 20"]
    assert {step.name: step.wait_ns for step in others}["wake"] == 500_000
    assert duration_ns([wait, silence, *others]) < 50_000_000
    assert rig.driver.frequency_hz == pytest.approx(50.03, abs=0.005)
    rig.play("0x70 W 00 51 -> refused")


def test_another_device_is_found_by_its_registers(rig: DrivenPca9685) -> None:
    rig.driver.silence()
    for register, value, read in ((0x02, 0xE3, "20 04 e3 e4"), (0x00, 0x21, "21 04 e2 e4")):
        wrong = ForcedRegister(address=0x40, register=register, value=value, times=None)
        rig.bus.faults = FaultScript([wrong])
        reason = f"PCA9685 at 0x40 on i2c-1: .*read {read} e8 e0, expected .*another device"
        with pytest.raises(WrongDevice, match=reason):
            rig.driver.identify()
    for level in (b"\x00", b"\xff"):
        bus = RegisterBus()
        bus.memory[0x40] = bytearray(level * 256)
        with pytest.raises(WrongDevice, match="PCA9685 at 0x40 on i2c-1: "):
            Pca9685(bus).identify()


def test_a_latched_external_clock_needs_a_software_reset(rig: DrivenPca9685) -> None:
    rig.play("W 00 10; W 00 50; warns EXTCLK set")
    with pytest.raises(
        NotReady, match=r"EXTCLK is latched .* power off and on, or send a software"
    ):
        rig.bring_up()
    rig.sent()
    software_reset(rig.bus)
    assert rig.sent() == ["0x00 W 06"]
    rig.bring_up()
    assert rig.chip.running


@pytest.mark.parametrize(
    "left_by",
    [
        pytest.param((), id="running"),
        pytest.param(("W 00 30",), id="asleep with a RESTART due"),
        pytest.param(("W 00 30", "W 06 00 00 00 08"), id="asleep, duties set"),
        pytest.param(("W 01 14",), id="inverted"),
        pytest.param(("W 01 0c",), id="waiting for four registers"),
    ],
)
def test_whatever_a_dead_program_left_no_output_goes_on_in_bring_up(
    rig: DrivenPca9685, left_by: tuple[str, ...]
) -> None:
    rig.bring_up().set_duties(0, (0.9,) * 16)
    for line in left_by:
        rig.play(line)
    driver = Pca9685(rig.bus)
    wait, *steps = driver.bring_up(50)
    rig.clock.advance(wait.wait_ns)
    for step in steps:
        step.action()
        assert rig.chip.all_off, step.name
        rig.clock.advance(step.wait_ns)
    driver.set_duties(0, (0.9,))
    rig.play(f"duties is {3686 / 4096} 0*15")


@pytest.mark.parametrize(
    ("written", "read"),
    [
        pytest.param("W 00 30; W fe 79; W 00 20", "20 04 79", id="the rate"),
        pytest.param("W 01 14", "20 14 05", id="inverted outputs"),
        pytest.param("W 01 0c", "20 0c 05", id="outputs that wait for four registers"),
        pytest.param("W 01 05", "20 05 05", id="outputs that are on while OE is high"),
        pytest.param("W 00 11", "11 11 05", id="that it is awake"),
    ],
)
def test_what_another_program_has_set_is_found_by_a_poll_and_cured_by_bring_up(
    rig: DrivenPca9685, driver: Pca9685, written: str, read: str
) -> None:
    rate = rig.chip.frequency_hz
    for look in (driver.poll, driver.verify):
        look()
        rig.play(written)
        with pytest.raises(NotReady, match=f"read {read}, expected 20 04 05; it was reset or writ"):
            look()
        refuses_duties(driver)
        rig.bring_up()
    driver.set_duties(0, (0.25,))
    driver.poll()
    assert rig.chip.frequency_hz == rate
    rig.play("duties is 0.25 0*15")


# Outputs ------------------------------------------------------------------------------------------


def test_eight_duties_are_one_burst_of_34_bytes(rig: DrivenPca9685, driver: Pca9685) -> None:
    driver.set_duties(4, [0.5] * 8)
    (messages,) = (each.messages for each in rig.bus.log)
    assert rig.sent() == ["W 16" + " 00 00 00 08" * 8]
    assert wire_bytes(messages) == 34
    assert bits(messages) == bits(duty_burst(8)) == 308


@pytest.mark.parametrize(
    ("duty", "counts", "written"),
    [
        (0.0, "00 00 00 10", 0.0),
        (1.0, "00 10 00 00", 1.0),
        (0.5, "00 00 00 08", 0.5),
        (0.1, "00 00 9a 01", 410 / 4096),
        (1 / 4096, "00 00 01 00", 1 / 4096),
        (1e-5, "00 00 00 10", 0.0),
        (4095 / 4096, "00 00 ff 0f", 4095 / 4096),
        (0.99999, "00 10 00 00", 1.0),
        (-0.0, "00 00 00 10", 0.0),
    ],
)
def test_a_duty_is_rounded_to_4096ths_and_its_ends_are_full(
    rig: DrivenPca9685, driver: Pca9685, duty: float, counts: str, written: float
) -> None:
    assert driver.set_duties(0, (duty,)) == (written,)
    assert rig.sent() == [f"W 06 {counts}"]


def test_staggered_channels_start_a_sixteenth_apart_with_the_same_duty() -> None:
    rig = DrivenPca9685(staggered=True)
    assert rig.bring_up().set_duties(14, (0.25, 0.25)) == (0.25, 0.25)
    # channel 14: on 0xE00, off 0x1200 - 0x1000; channel 15: on 0xF00, off 0x300
    assert rig.sent() == ["W 3e 00 0e 00 02 00 0f 00 03"]


@pytest.mark.parametrize(
    ("first", "duties", "fault"),
    [
        *(
            (0, (0.5, each), "a duty of .*, expected 0 to 1")
            for each in (-0.001, 1.001, math.nan, math.inf)
        ),
        *(
            (first, (0.5,) * count, f"{count} duties from channel {first}, expected them")
            for first, count in ((-1, 1), (15, 2), (16, 1), (0, 17), (3, 0))
        ),
    ],
)
def test_duties_and_channels_that_cannot_be_are_refused_and_nothing_is_sent(
    rig: DrivenPca9685, driver: Pca9685, first: int, duties: tuple[float, ...], fault: str
) -> None:
    with pytest.raises(ValueError, match=fault):
        driver.set_duties(first, duties)
    assert rig.sent() == []


def test_before_bring_up_duties_are_refused_and_stop_all_is_six_bytes(rig: DrivenPca9685) -> None:
    refuses_duties(rig.driver)
    assert rig.sent() == []
    rig.driver.stop_all()
    assert rig.sent() == STOP


def test_stop_all_stops_all_sixteen_and_duties_can_be_set_again(
    rig: DrivenPca9685, driver: Pca9685
) -> None:
    driver.set_duties(0, (0.7,) * 16)
    driver.stop_all()
    rig.play(OFF, RUNNING)
    driver.set_duties(0, (0.7,))
    rig.play(f"duties is {2867 / 4096} 0*15")


@pytest.mark.parametrize("mode2", ["14", "0c", "1f"])
def test_stop_all_stops_what_is_inverted_or_waits_for_four_registers(
    rig: DrivenPca9685, driver: Pca9685, mode2: str
) -> None:
    driver.set_duties(0, (0.7,) * 8)
    rig.play(f"W 01 {mode2}; W fd 10; all_off is False")
    assert f"MODE2 reads {mode2}, so full-off may be on" in str(driver.still_on())
    driver.stop_all()
    rig.play(OFF)
    assert driver.still_on() is None


def test_what_is_on_is_read_back_by_a_process_that_comes_later(
    rig: DrivenPca9685, driver: Pca9685
) -> None:
    later = Pca9685(rig.bus)
    assert later.still_on() is None
    driver.set_duties(3, (0.25, 0.0, 1.0))
    rig.sent()
    assert later.still_on() == "PCA9685 at 0x40 on i2c-1: outputs 3, 5 are on"
    assert [each.to_read for each in rig.bus.log] == [1, 0x45], "all registers up to LED15_OFF_H"
    later.stop_all()
    assert later.still_on() is None


def test_a_chip_that_does_not_count_registers_up_is_read_channel_by_channel(
    rig: DrivenPca9685,
) -> None:
    assert rig.driver.still_on() is None  # as after power-up
    rig.play("W 01 14")
    assert "MODE2 reads 14" in str(rig.driver.still_on())
    rig.play("W 01 04; W 09 00; warns channel 0 has ON == OFF")  # LED0_OFF_H
    assert rig.driver.still_on() == "PCA9685 at 0x40 on i2c-1: outputs 0 are on"
