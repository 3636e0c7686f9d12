import pytest
from firmware_drivers.chips.pca9685 import Pca9685, software_reset

from firmware_runtime.hal.wire_errors import NotReady
from tests.support.pca9685_on_its_double import DrivenPca9685

OFF, RUNNING = "all_off is True", "running is True"


@pytest.fixture
def rig() -> DrivenPca9685:
    return DrivenPca9685()


def refuses_duties(driver: Pca9685) -> None:
    with pytest.raises(NotReady):
        driver.set_duties(0, (0.5,) * 8)


@pytest.mark.parametrize(
    ("frequency_hz", "osc_hz"),
    [(24, 25e6), (1526, 25e6), (24, 24e6), (1400, 24e6), (50, 26.2e6), (1000, 26.2e6)],
)
def test_the_rate_the_driver_states_is_the_rate_of_a_chip_so_calibrated(
    frequency_hz: float, osc_hz: float
) -> None:
    rig = DrivenPca9685(osc_hz)
    driver = rig.bring_up(frequency_hz, osc_hz)
    assert rig.chip.frequency_hz == pytest.approx(driver.frequency_hz)
    rig.play(RUNNING, OFF)


def test_all_call_is_answered_at_power_up_and_never_again(rig: DrivenPca9685) -> None:
    rig.play("0x70 W 00 11")
    rig.bring_up()
    rig.play("0x70 W 00 51 -> refused")


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


def test_a_latched_external_clock_needs_a_software_reset(rig: DrivenPca9685) -> None:
    rig.play("W 00 10; W 00 50; warns EXTCLK set")
    with pytest.raises(NotReady, match="EXTCLK is latched"):
        rig.bring_up()
    software_reset(rig.bus)
    rig.bring_up()
    assert rig.chip.running


def test_stop_all_stops_all_sixteen_and_duties_can_be_set_again(rig: DrivenPca9685) -> None:
    driver = rig.bring_up()
    driver.set_duties(0, (0.7,) * 16)
    driver.stop_all()
    rig.play(OFF, RUNNING)
    driver.set_duties(0, (0.7,))
    rig.play(f"duties is {2867 / 4096} 0*15")


@pytest.mark.parametrize("mode2", ["14", "0c", "1f"])
def test_stop_all_stops_what_is_inverted_or_waits_for_four_registers(
    rig: DrivenPca9685, mode2: str
) -> None:
    driver = rig.bring_up()
    driver.set_duties(0, (0.7,) * 8)
    rig.play(f"W 01 {mode2}; W fd 10; all_off is False")
    assert f"MODE2 reads {mode2}, so full-off may be on" in str(driver.still_on())
    driver.stop_all()
    rig.play(OFF)
    assert driver.still_on() is None


@pytest.mark.parametrize(
    ("written", "read"),
    [
        pytest.param("W 00 30; W fe 79; W 00 20", "20 04 79", id="the rate"),
        pytest.param("W 01 14", "20 14 05", id="inverted outputs"),
        pytest.param("W 01 0c", "20 0c 05", id="outputs that wait for four registers"),
        pytest.param("W 01 05", "20 05 05", id="outputs that are on while OE is high"),
    ],
)
def test_what_another_program_has_set_is_found_by_a_poll_and_cured_by_bring_up(
    rig: DrivenPca9685, written: str, read: str
) -> None:
    driver = rig.bring_up()
    rate = rig.chip.frequency_hz
    rig.play(written)
    with pytest.raises(NotReady, match=f"read {read}, expected 20 04 05; it was reset or written"):
        driver.poll()
    refuses_duties(driver)
    driver = rig.bring_up()
    driver.set_duties(0, (0.25,))
    driver.poll()
    assert rig.chip.frequency_hz == rate
    rig.play("duties is 0.25 0*15")


def test_what_is_on_is_read_back_by_a_process_that_comes_later(rig: DrivenPca9685) -> None:
    driver, later = rig.bring_up(), Pca9685(rig.bus)
    assert later.still_on() is None
    driver.set_duties(3, (0.25, 0.0, 1.0))
    assert later.still_on() == "PCA9685 at 0x40 on i2c-1: outputs 3, 5 are on"
    later.stop_all()
    assert later.still_on() is None


def test_a_chip_that_does_not_count_registers_up_is_read_channel_by_channel(
    rig: DrivenPca9685,
) -> None:
    driver = Pca9685(rig.bus)
    assert driver.still_on() is None  # as after power-up
    rig.play("W 01 14")
    assert "MODE2 reads 14" in str(driver.still_on())
    rig.play("W 01 04; W 09 00; warns channel 0 has ON == OFF")  # LED0_OFF_H
    assert driver.still_on() == "PCA9685 at 0x40 on i2c-1: outputs 0 are on"
