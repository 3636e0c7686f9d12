"""A second sonar left at 0x70, where every PCA9685 answers from power-up: what comes of it."""

from firmware_drivers.chips.srf08 import Srf08

from firmware_runtime.devs.time import MILLISECOND
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

MODE1 = b"\x00"
EXTCLK, SLEEP, ALLCALL = 0x40, 0x10, 0x01


def test_two_pings_put_a_pca9685_to_sleep_and_latch_its_external_clock() -> None:
    clock = ManualClock()
    pwm = Pca9685Double(clock, 0x40)
    bus = I2cBusDouble("i2c1", clock, [pwm, Srf08Double(clock, 0x70, echoes=lambda _at: [1.0])])
    bus.write(0x40, bytes([0x00, 0x21]))  # awake, auto-increment, ALLCALL left on
    bus.write(0x40, bytes([0x06, 0, 0, 0, 8]))  # channel 0 at one half
    assert pwm.duty(0) == 0.5
    sonar = Srf08(bus, 0x70)
    for ping in (1, 2):
        sonar.start_ranging()
        clock.advance(100 * MILLISECOND)
        assert pwm.all_off, ping
    mode1 = bus.write_read(0x40, MODE1, 1)[0]
    assert mode1 & (EXTCLK | SLEEP | ALLCALL) == EXTCLK | SLEEP | ALLCALL
    bus.write(0x40, bytes([0x00, 0x20]))  # waking it up and clearing EXTCLK does not help
    assert bus.write_read(0x40, MODE1, 1)[0] & EXTCLK
    assert not pwm.running


def test_with_allcall_off_the_same_pings_do_no_harm() -> None:
    clock = ManualClock()
    pwm = Pca9685Double(clock, 0x40)
    bus = I2cBusDouble("i2c1", clock, [pwm, Srf08Double(clock, 0x70, echoes=lambda _at: [1.0])])
    bus.write(0x40, bytes([0x00, 0x20]))
    bus.write(0x40, bytes([0x06, 0, 0, 0, 8]))
    sonar = Srf08(bus, 0x70)
    sonar.start_ranging()
    clock.advance(100 * MILLISECOND)
    assert sonar.read_distance() == 1.0
    assert pwm.duty(0) == 0.5
