"""Doubles that take or give many bytes at once do what they do byte by byte."""

from collections.abc import Callable, Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_target import Target
from sim_doubles.inertial_truth import InertialTruth

Transfer = tuple[int, bytes | int]
"""How many ms to wait, then what to write or how much to read."""

MILLISECOND = 1_000_000

transfers = st.lists(
    st.tuples(
        st.integers(0, 30), st.binary(max_size=40) | st.integers(1, 40) | st.just(b"\x6a\x20")
    ),
    max_size=12,
)


def carry(clock: ManualClock, target: Target, address: int, all_: Sequence[Transfer]) -> list[str]:
    """What comes of each transfer, by the target's own way of taking many bytes."""
    seen = []
    for wait, message in all_:
        clock.advance(wait * MILLISECOND)
        acknowledged = target.start(address, read=isinstance(message, int))
        if acknowledged and isinstance(message, int):
            seen.append(target.read_bytes(message).hex())
        elif acknowledged and isinstance(message, bytes):
            seen.append(str(target.write_bytes(message)))
        target.stop()
        seen.append(str(vars(target).get("_registers")))
        seen.append(str(vars(target).get("_pointer")))
    return seen


def pca9685(now: ManualClock) -> Target:
    chip = Pca9685Double(now)
    chip.start(0x40, read=False)
    chip.write_bytes(b"\x00\x20")  # awake, counting registers up
    chip.stop()
    return chip


def mpu9250(now: ManualClock) -> Target:
    def truth(at: int) -> InertialTruth:
        wave = (at // MILLISECOND % 17) / 10.0
        return InertialTruth((wave, 0.0, 9.8), (0.0, wave, -wave), (1e-5, wave * 1e-6, 0.0), 25.0)

    magnetometer = Ak8963Double(now, lambda at: truth(at).field, noise_seed=None)
    chip = Mpu9250Double(now, truth, magnetometer=magnetometer, noise_seed=None)
    for message in (b"\x37\x02", b"\x6a\x20", b"\x25\x8c\x02\x88"):  # fetch ST1 to ST2 by itself
        chip.start(0x68, read=False)
        chip.write_bytes(message)
        chip.stop()
    magnetometer.start_from_mpu(now(), 0x0C, read=False)
    magnetometer.write_bytes(b"\x0a\x16")
    magnetometer.stop()
    return chip


def byte_by_byte(make: Callable[[ManualClock], Target], clock: ManualClock) -> Target:
    """The same chip without its short cuts."""
    chip = make(clock)
    one_by_one = {"write_bytes": Target.write_bytes, "read_bytes": Target.read_bytes}
    chip.__class__ = type(type(chip).__name__, (type(chip),), one_by_one)
    magnetometer = vars(chip).get("_magnetometer")
    if magnetometer is not None:
        magnetometer.__class__ = type("Ak8963", (type(magnetometer),), one_by_one)
    return chip


@given(transfers)
def test_a_pca9685_takes_a_message_as_it_takes_its_bytes(all_: list[Transfer]) -> None:
    clock, other = ManualClock(), ManualClock()
    at_once, each = pca9685(clock), byte_by_byte(pca9685, other)
    assert carry(clock, at_once, 0x40, all_) == carry(other, each, 0x40, all_)


@given(st.integers(0, 0x46), st.binary(min_size=1, max_size=70))
def test_duties_are_masked_and_kept_alike(register: int, content: bytes) -> None:
    clock, other = ManualClock(), ManualClock()
    at_once, each = pca9685(clock), byte_by_byte(pca9685, other)
    all_: list[Transfer] = [(0, bytes((register,)) + content), (0, 70)]
    assert carry(clock, at_once, 0x40, all_) == carry(other, each, 0x40, all_)


@pytest.mark.slow
@settings(max_examples=40)
@given(transfers)
def test_an_mpu9250_gives_registers_as_it_gives_each(all_: list[Transfer]) -> None:
    clock, other = ManualClock(), ManualClock()
    at_once, each = mpu9250(clock), byte_by_byte(mpu9250, other)
    read = [(wait, message) for wait, message in all_ if isinstance(message, int)]
    assert carry(clock, at_once, 0x68, read) == carry(other, each, 0x68, read)


@pytest.mark.slow
@settings(max_examples=40)
@given(st.integers(0, 0x75), st.integers(1, 30), st.integers(1, 40))
def test_a_sample_is_in_the_registers_whenever_they_are_read(
    register: int, length: int, wait: int
) -> None:
    clock, other = ManualClock(), ManualClock()
    at_once, each = mpu9250(clock), byte_by_byte(mpu9250, other)
    all_: list[Transfer] = [(wait, bytes((register,))), (wait, length), (wait, 8), (wait, b"\x3b")]
    assert carry(clock, at_once, 0x68, all_) == carry(other, each, 0x68, all_)


def test_a_setting_leaves_the_last_sample_as_it_was_taken() -> None:
    clock, other = ManualClock(), ManualClock()
    set_before_reading, read_only = mpu9250(clock), mpu9250(other)
    wait, write, read = 40, b"\x1b\x18", 7  # the gyroscope's range, and what it shows
    carry(clock, set_before_reading, 0x68, [(wait, write), (0, b"\x43")])
    carry(other, read_only, 0x68, [(wait, b"\x43")])
    set_ = carry(clock, set_before_reading, 0x68, [(0, read)])[0]
    assert set_ == carry(other, read_only, 0x68, [(0, read)])[0]
    assert set_[:12] != "00" * 6
