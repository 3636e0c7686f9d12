import math

import pytest
from firmware_drivers.chips.srf08 import INTERVAL_NS, Srf08, Srf08Settings
from firmware_drivers.chips.step import duration_ns
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady, Stuck, WrongDevice
from tests.support.bare_chip import BareChip, RegisterBus

SONAR = 0x73
SIX_METRES = Srf08Settings(max_range_m=6.0, gain=12)


class Bare(BareChip[Srf08]):
    def __init__(self) -> None:
        super().__init__(lambda bus: Srf08(bus, SONAR, SIX_METRES), SONAR, {0: b"\x0a"})

    def show(self, centimetres: int, *, revision: int = 10) -> None:
        self.hold({0: bytes((revision, 0x80, *centimetres.to_bytes(2, "big")))})

    def has_no_echo(self, reason: str) -> None:
        with pytest.raises(NotReady, match=reason):
            self.driver.read_distance()


@pytest.fixture
def bare() -> Bare:
    return Bare()


@pytest.fixture
def ranging(bare: Bare) -> Bare:
    bare.driver.start_ranging()
    return bare


# Settings -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("max_range_m", "register", "ranging_ms"),
    [(11.008, 255, 64), (6.02, 139, 35), (6.0, 139, 35), (0.043, 0, 0.25), (0.044, 1, 0.5)],
)
def test_the_range_register_and_the_time_follow_from_the_range(
    max_range_m: float, register: int, ranging_ms: float
) -> None:
    settings = Srf08Settings(max_range_m=max_range_m)
    assert settings.range_register() == register
    chip = Srf08(RegisterBus(), SONAR, settings)
    assert ranging_ms * 1e6 < chip.ranging_ns <= ranging_ms * 1e6 + 1e6
    assert chip.interval_ns == INTERVAL_NS == 65_000_000


@given(st.floats(0.0001, 11.008))
def test_the_range_reached_is_at_least_the_one_asked_and_43_mm_more_at_most(asked: float) -> None:
    register = Srf08Settings(max_range_m=asked).range_register()
    assert 0 <= register <= 255
    assert -1e-6 < (register + 1) * 0.043 - asked < 0.043


@pytest.mark.parametrize(
    ("address", "settings", "fault"),
    [
        (SONAR, Srf08Settings(max_range_m=0.0), "max_range_m: 0.0, expected more than 0, 11.008"),
        (SONAR, Srf08Settings(max_range_m=11.1), "max_range_m: 11.1"),
        (SONAR, Srf08Settings(max_range_m=math.nan), "max_range_m: nan"),
        (SONAR, Srf08Settings(gain=32), "gain: 32, expected 0 to 31"),
        (SONAR, Srf08Settings(gain=-1), "gain: -1"),
        (
            0x40,
            Srf08Settings(max_range_m=20, gain=99),
            "address: 0x40, .*max_range_m: 20, .*gain: 99",
        ),
    ],
)
def test_settings_the_chip_cannot_have_are_refused_all_at_once(
    address: int, settings: Srf08Settings, fault: str
) -> None:
    bus = RegisterBus()
    with pytest.raises(SettingError, match=f"SRF08 at 0x{address:02x} on i2c-1: {fault}"):
        Srf08(bus, address, settings)
    assert bus.wire == []


# Bring-up -----------------------------------------------------------------------------------------


def test_bring_up_waits_out_a_former_ranging_before_it_speaks(bare: Bare) -> None:
    wait, *proof = bare.driver.bring_up()
    wait.action()
    assert bare.sent == []
    assert wait.wait_ns > 64_000_000
    proof[0].action()
    assert bare.sent == [(b"\x00", 1), (b"\x01\x0c",), (b"\x02\xff",), (b"\x00\x51",)]
    assert 64_000_000 < duration_ns(proof) <= 80_000_000


@pytest.mark.parametrize("revision", [0x00, 0xFF])
def test_a_revision_that_is_none_is_another_device(bare: Bare, revision: int) -> None:
    bare.memory[0] = revision
    with pytest.raises(WrongDevice, match=rf"reads {revision:02x}, expected 01 to fe"):
        bare.driver.identify()


# Ranging ------------------------------------------------------------------------------------------


def test_nothing_is_read_before_a_ranging_nor_of_one_that_could_not_be_started(
    bare: Bare,
) -> None:
    bare.has_no_echo("no ranging to read")
    assert bare.sent == []
    bare.driver.start_ranging()
    assert bare.sent == [(b"\x01\x0c",), (b"\x02\x8b",), (b"\x00\x51",)]
    with bare.silent():
        bare.has_no_echo("expected the echo 36 ms after the ping")
    bare.show(100)
    assert bare.driver.read_distance() == 1.0, "though it was silent while ranging"
    with bare.silent(), pytest.raises(NoAcknowledge, match="no answer to a ranging command"):
        bare.driver.start_ranging()
    bare.has_no_echo("no ranging to read")


@pytest.mark.parametrize(
    ("centimetres", "metres"), [(1, 0.01), (256, 2.56), (607, 6.07), (0, math.inf)]
)
def test_an_echo_is_given_in_metres_and_once(
    ranging: Bare, centimetres: int, metres: float
) -> None:
    ranging.show(centimetres)
    assert ranging.driver.read_distance() == metres
    assert ranging.sent[-1] == (b"\x00", 4)
    ranging.bus.wire.clear()
    ranging.has_no_echo("no ranging to read")
    assert ranging.sent == []


@pytest.mark.parametrize(
    "read", ["ff 80 00 64", "ff 80 ff ff", "00 80 00 64", "0a 80 02 60", "00 00 00 00"]
)
def test_bytes_that_cannot_be_an_echo_are_not_made_one(ranging: Bare, read: str) -> None:
    """One from beyond the range that was written is none: of 602 cm and a step, 608."""
    ranging.hold({0: bytes.fromhex(read)})
    ranging.has_no_echo(f"registers 0 to 3 read {read}; expected")


# Proofs -------------------------------------------------------------------------------------------


def ranged(bare: Bare, echo: int) -> tuple[int, float]:
    """Range once; return the command that was sent, and the distance."""
    bare.driver.start_ranging()
    command = bare.memory[0]
    bare.show(echo)
    return command, bare.driver.read_distance()


def test_an_echo_where_there_was_none_is_proved_by_the_next_ranging(bare: Bare) -> None:
    found = [ranged(bare, echo) for echo in (0, 1, 58, 0, 200, 11_628, 201, 0, 30)]
    assert found == [
        (0x51, math.inf),
        (0x51, 0.01),
        (0x52, 0.01),
        (0x51, math.inf),
        (0x51, 2.0),
        (0x52, 2.0),
        (0x51, 2.01),
        (0x51, math.inf),
        (0x51, 0.3),
    ]
    assert ranged(bare, 0) == (0x52, math.inf), "the proof may be that there is none"


def test_bits_that_are_set_where_no_echo_is_are_found_by_the_next_ranging(bare: Bare) -> None:
    ranged(bare, 0)
    ranged(bare, 256)
    for readings in (2, 3):
        with pytest.raises(Stuck, match=f"echo reads 256 in {readings} readings in a row"):
            ranged(bare, 256)
    assert ranged(bare, 0) == (0x52, math.inf)


def test_bytes_that_cannot_be_an_echo_change_no_unit_of_the_ranging_they_were_read_of(
    bare: Bare,
) -> None:
    ranged(bare, 0)
    bare.driver.start_ranging()
    bare.show(0xFFFF)
    bare.has_no_echo("registers 0 to 3 read 0a 80 ff ff")
    bare.show(200)
    assert bare.driver.read_distance() == 2.0
