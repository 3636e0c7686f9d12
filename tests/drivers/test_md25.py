import math
import struct

import pytest
from firmware_drivers.chips.md25 import Md25, Md25Report, Md25Settings
from firmware_drivers.chips.step import duration_ns

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.budget import bits
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady, WrongDevice
from tests.support.bare_chip import BareChip, RegisterBus

STOP, SIGNED_STOP = b"\x00\x80\x80", b"\x00\x00\x00"


class Bare(BareChip[Md25]):
    def __init__(self, settings: Md25Settings | None = None) -> None:
        super().__init__(lambda bus: Md25(bus, settings=settings), 0x58, {0x0D: bytes((2, 5, 0))})

    def refuses(self, reason: str) -> None:
        """Check that no speed is set."""
        with pytest.raises(NotReady, match=reason):
            self.driver.set_speeds(0.1, 0.1)


@pytest.fixture
def fresh() -> Bare:
    return Bare()


@pytest.fixture
def running(fresh: Bare) -> Bare:
    """Return one that was brought up."""
    fresh.bring_up()
    fresh.bus.wire.clear()
    return fresh


# Bring-up -----------------------------------------------------------------------------------------


def test_bring_up_stops_sets_up_and_leaves_the_timeout_on() -> None:
    """The ramp is slowest while a stop may mean reverse."""
    bare = Bare(Md25Settings(acceleration=10))
    bare.bring_up()
    slow, mode = b"\x0e\x01", b"\x0f\x00"
    assert bare.written == [mode, STOP, slow, mode, STOP, b"\x0e\x0a", b"\x10\x31", b"\x10\x33"]
    assert bare.sent[-6:-4] == [(mode,), (STOP,)]
    assert duration_ns(bare.driver.bring_up()) == 0


@pytest.mark.parametrize(
    ("mode", "stop"), [(0, STOP), (1, SIGNED_STOP), (2, STOP), (3, SIGNED_STOP)]
)
def test_a_chip_left_in_another_mode_is_stopped_in_that_modes_words(
    fresh: Bare, mode: int, stop: bytes
) -> None:
    fresh.memory[0x0F] = mode
    fresh.bring_up()
    assert fresh.written[:2] == [bytes((0x0F, mode)), stop]
    assert fresh.memory[0x0F] == 0
    assert fresh.memory[0x00:0x02] == b"\x80\x80"


@pytest.mark.parametrize("found", ["00 05 00", "ff ff ff", "02 00 00", "02 05 04"])
def test_what_is_no_md25_is_refused_before_anything_is_written(fresh: Bare, found: str) -> None:
    fresh.hold({0x0D: bytes.fromhex(found)})
    with pytest.raises(WrongDevice, match=f"registers 13 to 15 read {found}, expected"):
        fresh.bring_up()
    assert fresh.written == []


@pytest.mark.parametrize("acceleration", [0, 11])
def test_an_acceleration_it_cannot_have_is_refused(acceleration: int) -> None:
    with pytest.raises(SettingError, match=f"acceleration: {acceleration}, expected 1 to 10"):
        Md25(RegisterBus(), settings=Md25Settings(acceleration=acceleration))


# Speeds -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("left", "right", "sent"),
    [
        (0.0, 0.0, STOP),
        (1.0, -1.0, b"\x00\xff\x01"),
        (-0.5, 0.5, b"\x00\x40\xc0"),
        (0.001, -0.0, STOP),
    ],
)
def test_speeds_are_one_burst_about_128(
    running: Bare, left: float, right: float, sent: bytes
) -> None:
    running.driver.set_speeds(left, right)
    assert running.sent == [(b"\x02", 14), (sent,)]
    assert sum(map(bits, running.sent)) == 194


def test_opposite_speeds_are_opposite_steps_and_the_report_is_read_in_the_same_call(
    running: Bare,
) -> None:
    for hundredths in range(-100, 101):
        speed = hundredths / 100
        running.driver.set_speeds(speed, -speed)
        _, left, right = bytes(running.written[-1])
        assert left + right == 2 * 128
        assert abs(left - 128 - 127 * speed) <= 0.5
    running.hold({0x02: struct.pack(">2i3B", -360, 70_000, 121, 3, 28)})
    report = running.driver.set_speeds(0.1, 0.2)
    assert report == pytest.approx(Md25Report(-360, 70_000, 12.1, 0.3, 2.8))


@pytest.mark.parametrize("speed", [1.001, -1.001, math.nan, math.inf])
def test_a_speed_that_is_none_is_refused_and_nothing_is_sent(running: Bare, speed: float) -> None:
    with pytest.raises(ValueError, match=r"speeds .*, expected -1 to 1"):
        running.driver.set_speeds(0.0, speed)
    assert running.sent == []


def test_it_is_driven_only_as_long_as_it_is_as_brought_up() -> None:
    """A new bring-up begins with what identifies it: its mode may be another by then."""
    bare = Bare(Md25Settings(acceleration=10))
    bare.refuses("speeds before bring-up")
    assert bare.sent == []
    bare.bring_up()
    bare.driver.identify()
    bare.bus.wire.clear()
    bare.refuses("speeds before bring-up")
    assert bare.sent == []
    bare.driver.verify()
    bare.driver.set_speeds(0.1, 0.1)
    bare.memory[0x0E] = 5
    bare.refuses("acceleration, mode read 5, 0, expected 10, 0; it was reset")
    bare.refuses("speeds before bring-up")
    bare.bring_up()
    bare.memory[0x0F] = 1
    with pytest.raises(NotReady, match="read 10, 1, expected 10, 0"):
        bare.driver.verify()
    bare.refuses("speeds before bring-up")
    bare.bring_up()
    bare.memory[0x0F] = 1
    bare.refuses("read 10, 1, expected 10, 0")
    bare.driver.stop()
    assert bare.written[-1] == SIGNED_STOP


@pytest.mark.parametrize(("mode", "stop"), [(0, STOP), (1, SIGNED_STOP), (3, SIGNED_STOP)])
@pytest.mark.parametrize("is_up", [False, True])
def test_stop_asks_for_the_mode_at_any_time(
    running: Bare, mode: int, stop: bytes, *, is_up: bool
) -> None:
    """In mode 0, the stop of a signed mode is full reverse; in a signed mode that of mode 0 is."""
    if not is_up:
        running.driver.identify()
        running.bus.wire.clear()
    running.memory[0x0F] = mode
    running.driver.stop()
    assert running.sent == [(b"\x0f", 1), (bytes((0x0F, mode)),), (stop,)]
    assert sum(map(bits, running.sent)) == 106


@pytest.mark.parametrize("mode", [0xFF, 0x05])
@pytest.mark.parametrize("is_up", [False, True])
def test_a_stop_whose_mode_reads_as_none_is_that_of_mode_0_and_not_taken_for_done(
    running: Bare, mode: int, *, is_up: bool
) -> None:
    """ff is read where nothing drives SDA: it has the bit of the signed modes."""
    if not is_up:
        running.driver.identify()
        running.bus.wire.clear()
    running.memory[0x0F] = mode
    with pytest.raises(WrongDevice, match=f"mode reads {mode:02x}"):
        running.driver.stop()
    assert running.written == [STOP]


@pytest.mark.parametrize(("is_up", "written"), [(False, []), (True, [STOP])])
def test_a_stop_whose_mode_is_not_answered_is_tried_in_the_last_words_and_not_taken_for_done(
    running: Bare, monkeypatch: pytest.MonkeyPatch, *, is_up: bool, written: list[bytes]
) -> None:
    if not is_up:
        running.driver.identify()
        running.bus.wire.clear()

    def deaf(address: int, data: bytes, length: int) -> bytes:
        raise NoAcknowledge(f"{address:#x} to {data!r}, {length} bytes")

    monkeypatch.setattr(running.bus, "write_read", deaf)
    with pytest.raises(NoAcknowledge):
        running.driver.stop()
    assert running.written == written
