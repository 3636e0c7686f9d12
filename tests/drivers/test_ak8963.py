import struct

import pytest
from firmware_drivers.chips.ak8963 import Ak8963

from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady
from tests.support.bare_chip import BareChip

Bare = BareChip[Ak8963]


@pytest.fixture
def bare() -> Bare:
    return BareChip(Ak8963, 0x0C, {0x00: b"\x48", 0x10: bytes((176, 128, 0))})


def test_modes_change_by_way_of_power_down_with_a_wait(bare: Bare) -> None:
    waits: dict[Message, int] = {}
    for step in bare.driver.bring_up():
        bare.bus.wire.clear()
        step.action()
        waits |= dict.fromkeys(bare.written, step.wait_ns)
    assert list(waits) == [b"\x0b\x01", b"\x0a\x0f", b"\x0a\x00", b"\x0a\x16"]
    assert all(wait >= 100_000 for wait in waits.values())
    assert waits[b"\x0a\x16"] >= 9_000_000


def test_sensitivity_is_read_in_fuse_rom_mode_and_halved_to_doubled_by_it(bare: Bare) -> None:
    bare.bring_up()
    fuse, power_down = (bare.sent.index((sent,)) for sent in (b"\x0a\x0f", b"\x0a\x00"))
    assert fuse < bare.sent.index((b"\x10", 3)) < power_down
    assert bare.driver.sensitivity == pytest.approx((0.15e-6 * 1.1875, 0.15e-6, 0.075e-6))


@pytest.mark.parametrize("fuse", [b"\x00\x00\x00", b"\xff\xff\xff"])
def test_a_fuse_rom_that_reads_one_level_is_a_fault(bare: Bare, fuse: bytes) -> None:
    bare.hold({0x10: fuse})
    with pytest.raises(NotReady, match=rf"fuse ROM reads {fuse.hex(' ')}; expected"):
        bare.bring_up()


def test_no_answer_hints_at_bypass(bare: Bare) -> None:
    with bare.silent(), pytest.raises(NoAcknowledge, match="bypass"):
        bare.bring_up()


def test_a_measurement_is_read_to_st2_and_given_in_tesla(bare: Bare) -> None:
    bare.bring_up()
    bare.hold({0x02: struct.pack("<B3hB", 0x01, 400, -32760, 3, 0x10)})
    assert bare.driver.read_field() == pytest.approx((71.25e-6, -4914e-6, 0.225e-6))
    assert bare.sent[-1] == (b"\x02", 8)


@pytest.mark.parametrize(
    ("st1", "st2", "reason"),
    [
        (0x00, 0x10, "no new measurement; expected 100 a second"),
        (0x01, 0x18, "ST2 reads 18; expected 10"),
        (0x01, 0x00, "ST2 reads 00; expected 10"),
    ],
)
def test_a_measurement_that_is_old_or_invalid_is_not_given(
    bare: Bare, st1: int, st2: int, reason: str
) -> None:
    bare.bring_up()
    bare.hold({0x02: struct.pack("<B3hB", st1, 1, 2, 3, st2)})
    with pytest.raises(NotReady, match=reason):
        bare.driver.read_field()
