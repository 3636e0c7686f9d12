"""Outputs that do not follow their chip, bytes that arrive inverted, and a fault's end."""

import pytest

from firmware_runtime import open_board
from firmware_runtime.board.struck_doubles import NO_DEVICES, StruckDoubles
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.strike import Span, Strike
from firmware_runtime.hal.wire_errors import NoAcknowledge
from firmware_runtime.recording.replay.replay_assertion import assert_replays
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.serial_line import SerialLineDouble

AWAKE = b"\x00\x20"
HALF = b"\x00\x00\x00\x08"
LED0 = 0x06


class Lamp:
    """A PCA9685 whose channels 0 and 1 are half on."""

    def __init__(self) -> None:
        self.now = ManualClock(SECOND)
        self.chip = Pca9685Double(self.now)
        self.buses = {"i2c1": I2cBusDouble("i2c1", self.now, [self.chip])}
        self.ports: dict[str, SerialLineDouble] = {}
        self.bus = self.buses["i2c1"]
        self.bus.transaction(0x40, (AWAKE,))
        self.write(HALF + HALF)
        self.struck = StruckDoubles(self, NO_DEVICES, self.now)

    def write(self, content: bytes) -> None:
        self.bus.transaction(0x40, (bytes([LED0]) + content,))

    def strike(self, kind: str, number: float, for_s: float | None = None) -> None:
        self.struck.strike(Strike(kind, "0x40", for_s=for_s, amount=number))


@pytest.mark.parametrize(
    ("kind", "at_once", "after"),
    [("ignored", 0.5, 0.5), ("weak", 0.25, 0.125), ("dead", 0.0, 0.0), ("full-on", 1.0, 1.0)],
)
def test_one_output_that_is_on_does_not_follow_what_its_registers_say(
    kind: str, at_once: float, after: float
) -> None:
    lamp = Lamp()
    lamp.strike(kind, 3.0)  # counted round those that are on: the second one
    assert lamp.bus.transaction(0x40, (bytes([LED0]), 8)) == HALF + HALF
    assert lamp.chip.duties[:3] == (0.5, at_once, 0.0)
    quarter = b"\x00\x00\x00\x04"
    lamp.write(quarter + quarter)
    assert lamp.chip.duties[:3] == (0.25, after, 0.0)
    assert lamp.bus.transaction(0x40, (bytes([LED0]), 8)) == quarter + quarter
    lamp.struck.clear()
    assert lamp.chip.duties[:3] == (0.25, 0.25, 0.0)


def test_an_output_is_broken_for_its_time() -> None:
    lamp = Lamp()
    lamp.strike("dead", 0.0, for_s=1.0)
    lamp.write(HALF)
    assert lamp.chip.duties[0] == 0.0
    lamp.now.advance(2 * SECOND)
    lamp.write(HALF)
    assert lamp.chip.duties[0] == 0.5


@pytest.mark.parametrize("kind", ["dead", "nack", "absent"])
def test_a_fault_without_end_gets_one_as_if_it_had_been_made_so(kind: str) -> None:
    lamp = Lamp()
    lamp.strike(kind, 0.0) if kind == "dead" else lamp.struck.strike(Strike(kind, "0x40"))
    end = lamp.now() + SECOND
    lamp.struck.end(end)
    assert [each.span for each in lamp.struck.struck] == [SECOND]
    if kind == "dead":
        lamp.write(HALF)
        assert lamp.chip.duties[0] == 0.0
    else:
        with pytest.raises(NoAcknowledge):
            lamp.write(HALF)
    lamp.now.advance(SECOND + 1)
    lamp.bus.transaction(0x40, (AWAKE,))
    lamp.write(HALF)
    assert lamp.chip.duties[0] == 0.5


def test_a_motor_does_not_follow_its_chip_on_a_serial_line() -> None:
    now = ManualClock(SECOND)
    chip = SabertoothDouble(now)
    line = SerialLineDouble("uart", now, chip)
    line.write(b"\xaa" + _packet(0, 64) + _packet(4, 64))
    now.advance(SECOND)
    first, second = chip.speeds
    assert first == second > 0
    assert {"weak", "garble", "silent"} <= set(line.fitting(None))
    line.strike("weak", None, Span(now(), now() + SECOND, once=False), 1.0)
    now.advance(SECOND // 2)
    assert chip.speeds[0] == first
    assert chip.speeds[1] == pytest.approx(second / 2, abs=0.01)
    now.advance(SECOND)
    line.read_available()
    now.advance(SECOND)
    assert chip.speeds == (first, second)


def test_a_motor_that_is_healed_and_breaks_again_stays_so_for_its_own_time() -> None:
    now = ManualClock(SECOND)
    chip = SabertoothDouble(now)
    line = SerialLineDouble("uart", now, chip)
    line.write(b"\xaa" + _packet(0, 64) + _packet(4, 64))
    line.strike("weak", None, Span(now(), now() + SECOND, once=False), 0.0)
    now.advance(2 * SECOND)
    line.read_available()
    line.end_strikes(now() + 2 * SECOND)
    line.strike("dead", None, Span(now(), now() + 10 * SECOND, once=False), 0.0)
    for _ in range(5):
        now.advance(SECOND)
        line.read_available()
    first, second = chip.speeds
    assert first == 0.0
    assert second > 0.0


def _packet(command: int, value: int) -> bytes:
    return bytes([128, command, value, (128 + command + value) & 0x7F])


def test_one_byte_arrives_inverted() -> None:
    now = ManualClock(SECOND)
    line = SerialLineDouble("uart", now, MaxbotixDouble(now, lambda _at: 1.0))
    now.advance(SECOND)
    line.read_available()
    line.strike("garble", None, Span(now(), now(), once=False), 0.0)
    now.advance(100 * MILLISECOND)
    assert line.read_available()[0] == ord("R") ^ 0xFF
    now.advance(100 * MILLISECOND)
    assert line.read_available()[0] == ord("R")


def test_a_run_in_virtual_time_is_stalled_and_replays(tmp_path: object) -> None:
    path = f"{tmp_path}/stalled.recording"
    stall = Strike("stall", at_s=1.0, amount=35.0)
    with open_board(
        "tachobot", doubles=True, clock="virtual", faults=[stall], record=path
    ) as robot:
        robot.run(1.2)
        assert robot.statistics.overruns == 3
    assert_replays(path)
