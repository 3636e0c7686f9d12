import math

import pytest
from firmware_drivers.chips.pca9685 import software_reset
from firmware_drivers.chips.pca9685_registers import actual_frequency_hz, duty_burst, prescale_for
from firmware_drivers.chips.step import duration_ns
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.budget import bits, wire_bytes
from firmware_runtime.hal.wire_errors import NotReady, WrongDevice
from tests.support.bare_pca9685 import BarePca9685


@pytest.fixture
def bare() -> BarePca9685:
    return BarePca9685()


@pytest.fixture
def running() -> BarePca9685:
    return BarePca9685(running=True)


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
            for rate in (23.9, 1527, 0, -50, math.inf, math.nan)
        ),
        (24, 27e6, r"24 Hz; expected 25\.\d to 1\d+\.\d Hz"),
        *((50, osc_hz, "expected 20e6 to 30e6") for osc_hz in (25, 0.0, math.nan, 50e6)),
    ],
)
def test_a_rate_or_an_oscillator_that_cannot_be_is_refused(
    frequency_hz: float, osc_hz: float, fault: str
) -> None:
    with pytest.raises(SettingError, match=fault):
        prescale_for(frequency_hz, osc_hz)


@given(st.floats(24.1, 1525), st.floats(24.9e6, 25.1e6))
def test_no_other_prescale_divides_the_oscillator_closer(
    frequency_hz: float, osc_hz: float
) -> None:
    prescale = prescale_for(frequency_hz, osc_hz)
    wanted = osc_hz / (4096 * frequency_hz)
    assert abs(prescale + 1 - wanted) <= 0.5 + 1e-9


# Bring-up -----------------------------------------------------------------------------------------


def test_bring_up_stops_the_outputs_and_leaves_allcall_before_anything_else(
    bare: BarePca9685,
) -> None:
    wait, silence, *_ = bare.driver.bring_up()
    wait.action()
    assert bare.sent == []
    silence.action()
    assert bare.written == [b"\x01\x04", b"\xfd\x10", b"\x00\x20"]
    assert silence.wait_ns > 1e9 / 23.84


def test_bring_up_sets_the_rate_asleep_and_wakes_by_half_a_millisecond(bare: BarePca9685) -> None:
    steps = bare.driver.bring_up(50)
    bare.take(steps)
    assert bare.written[3:] == [b"\x00\x30", b"\xfe\x79", b"\x00\x20"]
    assert {step.name: step.wait_ns for step in steps}["wake"] == 500_000
    assert duration_ns(steps) < 50_000_000
    assert bare.driver.frequency_hz == pytest.approx(50.03, abs=0.005)


def test_an_impossible_rate_is_refused_before_anything_is_sent(bare: BarePca9685) -> None:
    with pytest.raises(SettingError):
        bare.driver.bring_up(1600)
    assert bare.sent == []


@pytest.mark.parametrize(
    ("register", "content", "error", "reason"),
    [
        (0x02, b"\xe3", WrongDevice, "read 20 04 e3 e4 e8 e0, expected .*another device"),
        (0x00, b"\x00" * 256, WrongDevice, ""),
        (0x00, b"\xff" * 256, WrongDevice, ""),
        (0x00, b"\x60", NotReady, "EXTCLK is latched .* power off and on, or send a software"),
    ],
)
def test_another_device_and_a_latched_clock_are_found_by_the_registers(
    bare: BarePca9685, register: int, content: bytes, error: type[Exception], reason: str
) -> None:
    bare.driver.silence()
    bare.hold({register: content})
    with pytest.raises(error, match=f"PCA9685 at 0x40 on i2c-1: .*{reason}"):
        bare.driver.identify()


def test_after_a_failed_verify_no_duties_are_set(running: BarePca9685) -> None:
    running.driver.verify()
    running.memory[0x00] = 0x11
    with pytest.raises(NotReady, match="read 11 04 05, expected 20 04 05; it was reset"):
        running.driver.verify()
    with pytest.raises(NotReady, match="duties before bring-up"):
        running.driver.set_duties(0, (0.5,))


def test_software_reset_is_the_general_call_with_one_byte(bare: BarePca9685) -> None:
    software_reset(bare.bus)
    assert bare.bus.wire == [(0x00, (b"\x06",))]


# Outputs ------------------------------------------------------------------------------------------


def test_eight_duties_are_one_burst_of_34_bytes(running: BarePca9685) -> None:
    running.driver.set_duties(4, [0.5] * 8)
    (messages,) = running.sent
    assert messages == (bytes((0x06 + 4 * 4, *(0x00, 0x00, 0x00, 0x08) * 8)),)
    assert wire_bytes(messages) == 34
    assert bits(messages) == bits(duty_burst(8)) == 308


@pytest.mark.parametrize(
    ("duty", "counts", "written"),
    [
        (0.0, b"\x00\x00\x00\x10", 0.0),
        (1.0, b"\x00\x10\x00\x00", 1.0),
        (0.5, b"\x00\x00\x00\x08", 0.5),
        (0.1, b"\x00\x00\x9a\x01", 410 / 4096),
        (1 / 4096, b"\x00\x00\x01\x00", 1 / 4096),
        (1e-5, b"\x00\x00\x00\x10", 0.0),
        (4095 / 4096, b"\x00\x00\xff\x0f", 4095 / 4096),
        (0.99999, b"\x00\x10\x00\x00", 1.0),
        (-0.0, b"\x00\x00\x00\x10", 0.0),
    ],
)
def test_a_duty_is_rounded_to_4096ths_and_its_ends_are_full(
    running: BarePca9685, duty: float, counts: bytes, written: float
) -> None:
    assert running.driver.set_duties(0, (duty,)) == (written,)
    assert running.written == [b"\x06" + counts]


def test_staggered_channels_start_a_sixteenth_apart_with_the_same_duty() -> None:
    staggered = BarePca9685(running=True, staggered=True)
    assert staggered.driver.set_duties(14, (0.25, 0.25)) == (0.25, 0.25)
    # channel 14: on 0xE00, off 0x1200 - 0x1000; channel 15: on 0xF00, off 0x300
    assert staggered.written == [b"\x3e\x00\x0e\x00\x02\x00\x0f\x00\x03"]


@pytest.mark.parametrize(
    ("first", "duties", "fault"),
    [
        *((0, (0.5, each), "a duty of .*, expected 0 to 1") for each in (-0.001, 1.001)),
        *((0, (0.5, each), "a duty of .*, expected 0 to 1") for each in (math.nan, math.inf)),
        *(
            (first, (0.5,) * count, f"{count} duties from channel {first}, expected them")
            for first, count in ((-1, 1), (15, 2), (16, 1), (0, 17), (3, 0))
        ),
    ],
)
def test_duties_and_channels_that_cannot_be_are_refused_and_nothing_is_sent(
    running: BarePca9685, first: int, duties: tuple[float, ...], fault: str
) -> None:
    with pytest.raises(ValueError, match=fault):
        running.driver.set_duties(first, duties)
    assert running.sent == []


def test_duties_before_bring_up_are_refused(bare: BarePca9685) -> None:
    with pytest.raises(NotReady, match="duties before bring-up"):
        bare.driver.set_duties(0, (0.5,))
    assert bare.sent == []


def test_stop_all_is_six_bytes_in_any_state(bare: BarePca9685) -> None:
    bare.driver.stop_all()
    assert bare.sent == [(b"\x01\x04",), (b"\xfd\x10",)]
    assert [wire_bytes(sent) for sent in bare.sent] == [3, 3]
