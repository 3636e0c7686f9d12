"""Drivers on plain memories that a puppet keeps as the chips' doubles are."""

from collections.abc import Iterable

import pytest
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.step import Step

from firmware_runtime.devs.time import MILLISECOND
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target
from sim_doubles.inertial_truth import InertialTruth
from sim_doubles.register_ram import LOST_AFTER, SIZE, Puppet

TRUTH = InertialTruth((0.0, 0.0, 9.80665), (0.1, 0.2, 0.3), (20e-6, 0.0, -40e-6), 25.0)


class Memory(Target):
    """An EEPROM of 256 bytes: a pointer, then bytes, at any register."""

    def __init__(self, address: int) -> None:
        self.address = address
        self.content = bytearray(b"\xff" * SIZE)
        self._pointer = 0
        self._expects_pointer = False

    def start(self, address: int, *, read: bool) -> bool:
        self._expects_pointer = not read
        return address == self.address

    def write(self, byte: int) -> bool:
        if self._expects_pointer:
            self._pointer, self._expects_pointer = byte, False
        else:
            self.content[self._pointer] = byte
            self._pointer = (self._pointer + 1) % SIZE
        return True

    def read(self) -> int:
        byte = self.content[self._pointer]
        self._pointer = (self._pointer + 1) % SIZE
        return byte

    def stop(self) -> None:
        """Nothing waits for it."""

    def power_cycle(self) -> None:
        """It keeps what it has."""


class Emulator:
    """Both chips of TachoBot: as doubles, and as memories that a host can reach."""

    def __init__(self) -> None:
        self.clock = ManualClock()
        self.pwm = Pca9685Double(self.clock)
        self.imu = Mpu9250Double(self.clock, lambda _: TRUTH, who_am_i=0x70)
        doubles = I2cBusDouble("doubles", self.clock, (self.pwm, *self.imu.targets))
        self.memories = I2cBusDouble("memories", self.clock, (Memory(0x40), Memory(0x68)))
        self.written: list[tuple[int, bytes]] = []
        self.puppet = Puppet(
            doubles, (self.pwm, self.imu), self.clock, lambda *each: self.written.append(each)
        )
        self.settle()

    def settle(self) -> None:
        """Let the puppet see what was sent, and what it writes arrive, until nothing changes."""
        while self.memories.log or self.written:
            while self.memories.log:
                transaction = self.memories.log.popleft()
                for message in transaction.messages:
                    if isinstance(message, bytes):
                        self.puppet.sent(transaction.address, message)
            self.puppet.step()
            for address, message in self.written:
                self.memories.write(address, message)
            self.written.clear()

    def take(self, steps: Iterable[Step]) -> None:
        """Take each step, with the puppet looking in between."""
        for step in steps:
            step.action()
            self.settle()
            self.clock.advance(step.wait_ns)
            self.puppet.step()
            self.settle()


@pytest.fixture
def emulator() -> Emulator:
    return Emulator()


def test_a_memory_reads_as_the_chip_after_power_up(emulator: Emulator) -> None:
    assert emulator.memories.write_read(0x40, b"\x00", 6).hex() == "1104e2e4e8e0"
    assert emulator.memories.write_read(0x68, b"\x75", 1) == b"\x70"


def test_a_pwm_chip_is_brought_up_and_moves_its_outputs(emulator: Emulator) -> None:
    driver = Pca9685(emulator.memories)
    emulator.take(driver.bring_up(1000.0))
    assert emulator.pwm.running
    assert emulator.pwm.frequency_hz == pytest.approx(1000.0, rel=0.02)
    driver.set_duties(0, (0.25, 0.5))
    emulator.settle()
    assert emulator.pwm.duties[:2] == pytest.approx((0.25, 0.5), abs=1e-3)
    driver.stop_all()
    emulator.settle()
    assert emulator.pwm.all_off
    assert emulator.memories.write_read(0x40, b"\x09", 1) == b"\x10"  # LED0_OFF_H, by ALL_LED


def test_a_double_takes_in_order_what_was_sent_before_the_puppet_looked(emulator: Emulator) -> None:
    driver = Pca9685(emulator.memories)
    emulator.take(driver.bring_up(1000.0))
    rate_hz = emulator.pwm.frequency_hz
    for message in (b"\x00\x30", b"\xfe\x1e", b"\x00\x20"):  # asleep, slower, awake
        emulator.memories.write(0x40, message)
    emulator.settle()
    assert emulator.pwm.frequency_hz < rate_hz / 4


def test_what_the_puppet_overwrote_is_put_right(emulator: Emulator) -> None:
    driver = Pca9685(emulator.memories)
    emulator.take(driver.bring_up(1000.0))
    driver.stop_all()
    emulator.memories.log.clear()
    emulator.puppet.sent(0x40, b"\xfd\x10")
    emulator.puppet.step()  # full-off of every output is on its way,
    driver.set_duties(0, (0.25,))  # when a duty is set
    emulator.settle()
    assert emulator.pwm.duties[0] == pytest.approx(0.25, abs=1e-3)
    assert emulator.memories.write_read(0x40, b"\x09", 1) == emulator.pwm.content[9:10]


def test_what_arrives_after_it_was_given_up_is_not_taken_for_the_hosts(emulator: Emulator) -> None:
    emulator.puppet.power_cycle(0x40)
    late = emulator.written.copy()
    emulator.written.clear()
    emulator.clock.advance(2 * LOST_AFTER)
    emulator.puppet.step()
    assert emulator.written
    assert not any(emulator.puppet.sent(*each) for each in (*late, *emulator.written))


def test_what_is_sent_to_where_no_memory_is_comes_from_the_host(emulator: Emulator) -> None:
    assert emulator.puppet.sent(0x23, b"\x00\x01")


def test_a_sensor_is_brought_up_and_measures(emulator: Emulator) -> None:
    driver = Mpu9250(emulator.memories)
    emulator.take(driver.bring_up())
    emulator.clock.advance(100 * MILLISECOND)
    emulator.puppet.step()
    emulator.settle()
    sample = driver.read_sample()
    assert sample.rate == pytest.approx(TRUTH.rate, abs=0.02)
    assert sample.acceleration[2] == pytest.approx(9.8, abs=0.2)


def test_a_chip_that_lost_its_supply_is_as_after_power_up(emulator: Emulator) -> None:
    driver = Pca9685(emulator.memories)
    emulator.take(driver.bring_up(1000.0))
    driver.set_duties(0, (0.25,))
    emulator.settle()
    emulator.puppet.power_cycle(0x40)
    emulator.settle()
    assert emulator.pwm.all_off
    assert emulator.memories.write_read(0x40, b"\x00", 6).hex() == "1104e2e4e8e0"
