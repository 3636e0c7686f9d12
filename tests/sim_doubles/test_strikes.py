"""Faults by kind on doubles: what each does on the wire, where, for how long, and how it ends."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal
from unittest.mock import Mock

import pytest

from firmware_runtime.board.faults import Device
from firmware_runtime.board.struck_doubles import NoDevices, StruckDoubles
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.served import strikes
from firmware_runtime.hal.served.client import ServedDoubles
from firmware_runtime.hal.served.connection import Connection
from firmware_runtime.hal.served.packets import ClearFaults, FaultList, FaultQuestion, ListFaults
from firmware_runtime.hal.served.strikes import ask_faults
from firmware_runtime.hal.strike import KINDS, Span, Strike, Use
from firmware_runtime.hal.wire_errors import (
    ArbitrationLost,
    BusFault,
    BusTimeout,
    HalError,
    NoAcknowledge,
)
from sim_doubles.chip_doubles import chip_double
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.ak8963 import HOFL
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target
from sim_doubles.serial_line import SerialLineDouble
from tests.support.served_rig import SERIAL_SONAR, ServedRig, served_rig

WHO_AM_I = 0x75
ALL_CALL = 0x70


class Robot:
    """A served rig, as a client sees it."""

    def __init__(self, rig: ServedRig) -> None:
        self.rig = rig
        self.bus: I2cBus = ServedDoubles(rig.ask, ["i2c1"], []).buses["i2c1"]

    def faults(self, asked: FaultQuestion) -> FaultList:
        return ask_faults(self.rig.ask, asked)

    def strike(self, kind: str, device: str = "", for_s: float | None = None) -> None:
        self.faults(Strike(kind, device, for_s=for_s))

    def read(self, address: int, register: int, length: int = 1) -> bytes:
        return self.bus.transaction(address, (bytes([register]), length))

    def wait(self, span: int) -> None:
        self.rig.clock.advance(span)


@contextmanager
def robot(board: str, *assignments: str) -> Iterator[Robot]:
    with served_rig(board, *assignments) as rig:
        yield Robot(rig)


@pytest.mark.parametrize(
    ("kind", "error"),
    [
        ("nack", NoAcknowledge),
        ("nack-data", NoAcknowledge),
        ("stuck", BusTimeout),
        ("arbitration", ArbitrationLost),
        ("fault", BusFault),
        ("absent", NoAcknowledge),
    ],
)
def test_a_device_fails_for_its_time_and_no_other(kind: str, error: type[HalError]) -> None:
    assert KINDS[kind].fails
    with robot("tachobot") as tachobot:
        tachobot.strike(kind, "imu", for_s=1.0)
        with pytest.raises(error):
            tachobot.read(0x68, WHO_AM_I)
        assert tachobot.read(0x40, 0xFE) == b"\x1e"
        tachobot.wait(2 * SECOND)
        with pytest.raises(NoAcknowledge) if kind == "absent" else _nothing():
            tachobot.read(0x68, WHO_AM_I)  # a chip that has power again takes its time
        tachobot.wait(SECOND)
        assert tachobot.read(0x68, WHO_AM_I) == b"\x71"


@contextmanager
def _nothing() -> Iterator[None]:
    yield


def test_once_is_one_transaction() -> None:
    with robot("tachobot") as tachobot:
        tachobot.strike("nack", "imu", for_s=0)
        tachobot.wait(SECOND)
        with pytest.raises(NoAcknowledge):
            tachobot.read(0x68, WHO_AM_I)
        assert tachobot.read(0x68, WHO_AM_I) == b"\x71"


@pytest.mark.parametrize("device", ["", "i2c1", "imu", "0x68", "i2c1@0x68", "104"])
def test_a_chip_is_named_by_its_table_its_line_or_its_address(device: str) -> None:
    with robot("tachobot") as tachobot:
        tachobot.strike("zero", device)
        assert tachobot.read(0x68, WHO_AM_I) == b"\x00"


def test_frozen_registers_answer_what_they_had_and_thaw(
    waking: Callable[[Robot], None],
) -> None:
    with robot("tachobot") as tachobot:
        waking(tachobot)
        before = tachobot.read(0x68, 0x3B, 14)
        tachobot.strike("freeze", "imu", for_s=1.0)
        tachobot.wait(SECOND // 2)
        assert tachobot.read(0x68, 0x3B, 14) == before
        first = tachobot.read(0x68, 0x43, 6)  # asked for in this way for the first time
        tachobot.wait(SECOND // 4)
        assert tachobot.read(0x68, 0x43, 6) == first
        tachobot.wait(SECOND)
        assert tachobot.read(0x68, 0x3B, 14) != before


@pytest.fixture
def waking() -> Callable[[Robot], None]:
    """Wakes an MPU-9250 up, and waits until it samples."""

    def wake(tachobot: Robot) -> None:
        tachobot.bus.transaction(0x68, (b"\x6b\x01",))
        tachobot.wait(100 * MILLISECOND)

    return wake


@pytest.mark.parametrize(("kind", "byte"), [("zero", 0x00), ("ones", 0xFF)])
def test_every_byte_read_is_the_same_and_what_is_written_arrives(kind: str, byte: int) -> None:
    with robot("tachobot") as tachobot:
        tachobot.strike(kind, "thrust_pairs")
        tachobot.bus.transaction(0x40, (b"\xfe\x05",))
        assert tachobot.read(0x40, 0xFE, 1) == bytes([byte])
        tachobot.faults(ClearFaults())
        assert tachobot.read(0x40, 0xFE) == b"\x05"


@pytest.mark.parametrize("kind", ["brown-out", "absent"])
def test_a_chip_without_supply_drives_nothing_at_once_and_is_as_new(kind: str) -> None:
    with robot("tachobot") as tachobot:
        _drive(tachobot)
        assert tachobot.rig.doubles.outputs == {"thrust_pairs": 1}
        tachobot.strike(kind, "thrust_pairs", for_s=None if kind == "brown-out" else 1.0)
        assert tachobot.rig.doubles.outputs == {"thrust_pairs": 0}
        tachobot.wait(2 * SECOND)
        assert tachobot.read(0x40, 0xFE) == b"\x1e"
        assert tachobot.read(0x40, 0x00) == b"\x11"  # asleep


def test_a_cleared_chip_has_supply_again_and_is_as_new() -> None:
    with robot("tachobot") as tachobot:
        _drive(tachobot)
        tachobot.strike("absent", "thrust_pairs")
        with pytest.raises(NoAcknowledge):
            tachobot.read(0x40, 0x00)
        listing = tachobot.faults(ClearFaults())
        assert tachobot.read(0x40, 0x00) == b"\x11"
        assert listing.struck[0].span is not None


def _drive(tachobot: Robot) -> None:
    tachobot.bus.transaction(0x40, (b"\x00\x21",))
    tachobot.bus.transaction(0x40, (b"\x06\x00\x10\x00\x00",))


@pytest.mark.parametrize(("kind", "rest"), [("silent", b""), ("absent", b""), ("drop", None)])
def test_a_serial_line_is_silent_or_loses_a_byte(kind: str, rest: bytes | None) -> None:
    with robot("detective", *SERIAL_SONAR) as detective:
        port = ServedDoubles(detective.rig.ask, [], ["sonar"]).ports["sonar"]
        detective.wait(SECOND)
        port.read_available()
        detective.strike(kind, "body_sonar")
        detective.wait(SECOND)
        arrived = port.read_available()
        assert arrived == rest if rest is not None else arrived[:1] != b"R"
        detective.faults(ClearFaults())
        detective.wait(SECOND)
        assert b"R" in port.read_available()


def test_the_list_has_devices_kinds_and_what_was_done() -> None:
    with robot("detective", *SERIAL_SONAR) as detective:
        detective.wait(SECOND)
        detective.strike("freeze", "body_compass", for_s=2.0)
        listing = detective.faults(ListFaults())
    names = [place.name for place in listing.places]
    assert names[-2:] == ["i2c1", "sonar"]
    assert {"body_compass", "body_sonar", "treads"} < set(names)
    assert [place.what for place in listing.places[-2:]] == ["line", "line"]
    sonar = next(place for place in listing.places if place.name == "body_sonar")
    assert sonar.what == sonar.chip
    assert (sonar.line, sonar.kinds) == (
        "sonar",
        (
            *("late", "freeze-axis", "offset", "scale", "full-scale", "noise"),
            *("silent", "drop", "garble", "brown-out", "absent"),
        ),
    )
    (made,) = listing.struck
    assert (made.kind, made.device, made.at, made.span) == (
        "freeze",
        "body_compass",
        SECOND,
        2 * SECOND,
    )
    assert listing.assignments == SERIAL_SONAR


def test_it_knows_when_the_one_that_drives_began() -> None:
    with robot("tachobot") as tachobot:
        tachobot.wait(SECOND)
        assert tachobot.faults(ListFaults()).began_at is None
        tachobot.read(0x68, WHO_AM_I)
        tachobot.wait(SECOND)
        tachobot.read(0x68, WHO_AM_I)
        assert tachobot.faults(ListFaults()).began_at == SECOND


@pytest.mark.parametrize(
    ("strike", "said"),
    [
        (Strike("melt"), "kind 'melt'"),
        (Strike("nak"), "did you mean nack"),
        (Strike("freeze", "imv"), "did you mean imu"),
        (Strike("freeze", "0x69"), "no device, line or address '0x69'"),
        (Strike("silent", "imu"), "not on these doubles"),
        (Strike("freeze", "imu", at_s=-1), "expected 0 or more"),
        (Strike("freeze", "imu", for_s=float("nan")), "expected 0 or more"),
        (Strike("absent", "imu", for_s=0), "expected more than 0"),
        (Strike("brown-out", "imu", for_s=1.0), "over at once"),
        (Strike("freeze", "imu", amount=2.0), "has no amount"),
    ],
    ids=str,
)
def test_what_cannot_be_is_refused_in_one_sentence(strike: Strike, said: str) -> None:
    with robot("tachobot") as tachobot, pytest.raises(ConfigError) as refused:
        tachobot.faults(strike)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_kind_that_does_not_fit_a_device_says_which_do() -> None:
    fitting = pytest.raises(ConfigError, match="silent, drop, garble, brown-out, absent")
    with robot("detective", *SERIAL_SONAR) as detective, fitting:
        detective.strike("freeze", "body_sonar")


class StrangersLines:
    """Doubles that somebody else tied together, with a chip that says no address."""

    def __init__(self, now: ManualClock) -> None:
        self.buses = {"front": I2cBusDouble("front", now, [Nameless(Pca9685Double(now))])}
        self.ports = {"gps": SerialLineDouble("gps", now, MaxbotixDouble(now, lambda _at: 1.0))}


class Nameless(Target):
    """Passes on what it is asked."""

    def __init__(self, inner: Target) -> None:
        self._inner = inner

    def start(self, address: int, *, read: bool) -> bool:
        return self._inner.start(address, read=read)

    def write(self, byte: int) -> bool:
        return self._inner.write(byte)

    def read(self) -> int:
        return self._inner.read()

    def stop(self) -> None:
        self._inner.stop()

    def power_cycle(self) -> None:
        self._inner.power_cycle()


def test_a_strangers_lines_can_be_broken_without_a_word_of_theirs() -> None:
    now = ManualClock(SECOND)
    lines = StrangersLines(now)
    wired = NoDevices(devices=[Device("lamp", "PCA9685", "front", 0x40)])
    struck = StruckDoubles(lines, wired, now)
    assert [place.name for place in struck.places] == ["lamp", "front", "gps"]
    assert "push" not in [kind.name for kind in struck.kinds]
    bus, port = lines.buses["front"], lines.ports["gps"]
    bus.transaction(0x40, (b"\xfe\x05",))
    struck.strike(Strike("absent", "lamp", at_s=1.0, for_s=1.0), SECOND)
    struck.strike(Strike("silent", "gps", at_s=0.5), SECOND)
    assert bus.transaction(0x40, (b"\xfe", 1)) == b"\x05"
    now.advance(SECOND + 1)
    with pytest.raises(NoAcknowledge):
        bus.transaction(0x40, (b"\xfe", 1))
    sent = port.read_available()
    assert sent
    now.advance(SECOND)
    assert bus.transaction(0x40, (b"\xfe", 1)) == b"\x1e"
    assert port.read_available() == b""
    struck.clear()
    now.advance(SECOND)
    assert b"R" in port.read_available()


def test_a_fault_without_an_end_may_be_given_one() -> None:
    now = ManualClock(SECOND)
    lines = StrangersLines(now)
    wired = NoDevices(devices=[Device("lamp", "PCA9685", "front", 0x40)])
    struck = StruckDoubles(lines, wired, now)
    bus, port = lines.buses["front"], lines.ports["gps"]
    struck.strike(Strike("nack", "lamp"))
    struck.strike(Strike("silent", "gps"))
    struck.end(3 * SECOND)
    now.advance(2 * SECOND)
    with pytest.raises(NoAcknowledge):
        bus.transaction(0x40, (b"\xfe", 1))
    assert port.read_available() == b""
    assert [each.span for each in struck.struck] == [2 * SECOND, 2 * SECOND]
    now.advance(SECOND)
    assert bus.transaction(0x40, (b"\xfe", 1)) == b"\x1e"
    assert b"R" in port.read_available()


def test_many_strikes_leave_no_long_script_behind() -> None:
    with robot("tachobot") as tachobot:
        for _ in range(50):
            tachobot.strike("nack", "imu", for_s=0.01)
            tachobot.strike("brown-out", "imu")
            tachobot.wait(SECOND)
        script = tachobot.rig.doubles.buses["i2c1"].faults
        assert script is not None
        assert len(script.faults) <= 2


@pytest.mark.parametrize(
    ("strike", "span"),
    [
        (Strike("nack"), NEVER),
        (Strike("nack", for_s=0.5), SECOND // 2),
        (Strike("nack", for_s=0), 0),
        (Strike("brown-out"), 0),
    ],
    ids=["without an end", "for a while", "once", "over at once"],
)
def test_how_long_a_fault_lasts(strike: Strike, span: int) -> None:
    assert strike.span == span


def test_a_fault_is_named_with_its_amount_and_its_device() -> None:
    assert str(Strike("nack")) == "nack"
    assert str(Strike("weak", "treads", amount=2.5)) == "weak 2.5 of treads"


@pytest.mark.parametrize("reads", [False, True])
@pytest.mark.parametrize("writes", [False, True])
def test_a_kind_shows_in_a_use_that_has_what_it_needs(*, reads: bool, writes: bool) -> None:
    use = Use(0, 0x68, reads, writes)
    assert use.shows(KINDS["nack"])
    assert use.shows(KINDS["freeze"]) is reads
    assert use.shows(KINDS["nack-data"]) is writes


def test_a_program_makes_a_fault_that_strikes_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    with robot("tachobot") as tachobot:
        connection = Mock(spec=Connection, ask=tachobot.rig.ask)
        monkeypatch.setattr(strikes, "Connection", lambda _path: connection)
        tachobot.wait(SECOND)
        (made,) = strikes.strike(Path("doubles.sock"), "zero", "imu").struck
        assert made.at == SECOND
        assert tachobot.read(0x68, WHO_AM_I) == b"\x00"
        connection.close.assert_called_once_with()


def test_every_kind_says_what_it_is() -> None:
    assert all(kind.meaning and kind.name == name for name, kind in KINDS.items())
    numbered = {name for name, kind in KINDS.items() if kind.unit.startswith("number of")}
    assert numbered == {name for name, kind in KINDS.items() if kind.is_numbered}
    assert {KINDS[name].amount for name in numbered} == {0.0}, "the first one"
    moments = {name for name, kind in KINDS.items() if kind.is_moment}
    assert moments == {"drop", "garble", "brown-out", "push", "reload", "stall"}


UP = 2
"""Number of the word among those that an MPU-9250 measures: its acceleration upwards."""
G = 16384


def burst(tachobot: Robot) -> list[int]:
    """Acceleration, temperature and rate, as words."""
    data = tachobot.read(0x68, 0x3B, 14)
    return [int.from_bytes(data[at : at + 2], "big", signed=True) for at in range(0, 14, 2)]


@pytest.fixture
def awake(waking: Callable[[Robot], None]) -> Iterator[Robot]:
    """A TachoBot whose IMU samples."""
    with robot("tachobot") as tachobot:
        waking(tachobot)
        yield tachobot


@pytest.mark.parametrize(
    ("kind", "up"), [("offset", G + 2000), ("scale", 2 * G - 1), ("negate", -G)]
)
def test_one_measured_word_is_another_and_the_others_are_as_they_were(
    awake: Robot, kind: str, up: int
) -> None:
    awake.faults(Strike(kind, "imu", for_s=1.0, amount=UP))
    found = burst(awake)
    assert found[UP] == pytest.approx(up, abs=200)
    assert found[:UP] == pytest.approx([0, 0], abs=200)
    assert awake.read(0x68, WHO_AM_I) == b"\x71"
    awake.wait(2 * SECOND)
    assert burst(awake)[UP] == pytest.approx(G, abs=200)


NO_SIGN = {("cmps12", 0x02), ("srf08", 0x02)}
"""Words that are never negative: a bearing, and a time of flight."""


@pytest.mark.parametrize(
    ("name", "words", "first", "registers", "order"),
    [
        ("ads1115", 1, 0, (0x00, 0x00), "big"),
        ("cmps12", 4, 0, (0x02, 0x06, 0x08, 0x0A, 0x02), "big"),
        ("hmc5883l", 3, 0, (0x03, 0x05, 0x07, 0x03), "big"),
        ("mpu9250", 9, 0, (0x3B, 0x3D, 0x3F, 0x43, 0x45, 0x47), "big"),
        ("mpu9250", 9, 6, (0x4A, 0x4C, 0x4E), "little"),
        ("mpu9250", 9, 9, (0x3B,), "big"),
        ("mpu9250", 9, 18, (0x3B,), "big"),
        ("mpu9250", 9, 27, (0x3B,), "big"),
        ("srf08", 1, 0, (0x02, 0x02), "big"),
    ],
)
def test_words_are_counted_round_in_the_order_of_the_registers_that_measure(
    name: str, words: int, first: int, registers: tuple[int, ...], order: Literal["big", "little"]
) -> None:
    chip, clock = chip_double(name), ManualClock()
    assert chip.address is not None
    for number, register in enumerate(registers, first):
        bus = I2cBusDouble("i2c1", clock, chip.on_bus(clock, chip.address))
        asked = (bytes([register]), 2)
        before = int.from_bytes(bus.transaction(chip.address, asked), order, signed=True)
        bus.strike("offset", chip.address, Span(0, NEVER, once=False), number)
        after = int.from_bytes(bus.transaction(chip.address, asked), order, signed=True)
        is_less = number // words % 2 == 1 and (name, register) not in NO_SIGN
        assert after == before + (-2000 if is_less else 2000), number


@pytest.mark.parametrize(("kind", "is_said"), [("full-scale", True), ("offset", False)])
def test_a_field_at_the_end_of_its_scale_is_said_to_overflow_as_the_chip_does(
    kind: str, *, is_said: bool
) -> None:
    chip, clock = chip_double("mpu9250"), ManualClock()
    assert chip.address is not None
    bus = I2cBusDouble("i2c1", clock, chip.on_bus(clock, chip.address))
    bus.strike(kind, chip.address, Span(0, NEVER, once=False), 6)
    *field, status = bus.transaction(chip.address, (b"\x4a", 7))
    assert field[:2] == ([0xFF, 0x7F] if is_said else [0xD0, 0x07])  # of 0, and 2000
    assert bool(status & HOFL) == is_said
    assert len(bus.transaction(chip.address, (b"\x4a", 6))) == 6  # its status is not read
    assert len(bus.transaction(chip.address, (b"\x4a", 9))) == 9


def test_a_word_without_a_sign_has_its_greatest_number_at_the_end_of_its_scale() -> None:
    chip, clock = chip_double("srf08"), ManualClock()
    assert chip.address is not None
    bus = I2cBusDouble("i2c1", clock, chip.on_bus(clock, chip.address))
    bus.strike("full-scale", chip.address, Span(0, NEVER, once=False), 0)
    assert bus.transaction(chip.address, (b"\x02", 2)) == b"\xff\xff"


def test_a_use_of_a_bus_reads_or_writes_or_both() -> None:
    chip, clock = chip_double("hmc5883l"), ManualClock()
    assert chip.address is not None
    bus = I2cBusDouble("i2c1", clock, chip.on_bus(clock, chip.address))
    for messages in ((b"\x02\x00",), (b"\x02", 1), (1,)):
        bus.transaction(chip.address, messages)
    kinds = [(each.reads, each.writes) for each in bus.uses()]
    assert kinds == [(True, False), (True, True), (False, True)]


@pytest.mark.parametrize("broken", [0, 1, 3])
@pytest.mark.parametrize("kind", ["full-scale", "freeze-axis", "negate"])
def test_of_inputs_that_take_turns_in_a_word_the_one_is_broken_that_is_read_first(
    kind: str, broken: int
) -> None:
    clock, volts = ManualClock(), [0.25, 0.5, 0.75, 1.0]
    chip = Ads1115Double(clock, inputs=lambda _at: volts)
    bus = I2cBusDouble("i2c1", clock, [chip])

    def read(pin: int) -> float:
        single_shot = 0xC583 | pin << 12  # against ground, 2.048 V, the slowest but three
        bus.transaction(chip.address, (bytes([1, single_shot >> 8, single_shot & 0xFF]),))
        clock.advance(SECOND // 100)
        answer = bus.transaction(chip.address, (b"\x00", 2))
        return int.from_bytes(answer, "big", signed=True) / 0x8000 * 2.048

    first = {pin: read(pin) for pin in range(4)}
    bus.strike(kind, chip.address, Span(0, NEVER, once=False), 0)
    seen = {pin: read(pin) for pin in (broken, 0, 1, 2, 3)}
    volts[:] = [each + 0.1 for each in volts]
    later = {pin: read(pin) for pin in range(4)}
    said = {"full-scale": 2.048, "negate": -first[broken], "freeze-axis": first[broken]}[kind]
    for pin in range(4):
        if pin != broken:
            assert later[pin] == pytest.approx(first[pin] + 0.1, abs=1e-3)
        else:
            assert seen[pin] == pytest.approx(said, abs=1e-3)
            assert later[pin] != pytest.approx(first[pin] + 0.1, abs=1e-3)


@pytest.mark.parametrize(("number", "other"), [(1, 2), (UP, 0)])
def test_a_word_is_exchanged_with_the_next_one_and_the_last_with_the_first(
    awake: Robot, number: int, other: int
) -> None:
    expected = burst(awake)
    expected[number], expected[other] = expected[other], expected[number]
    awake.faults(Strike("swap", "imu", amount=number))
    assert burst(awake) == pytest.approx(expected, abs=200)


@pytest.mark.parametrize(
    ("name", "kind", "fits"),
    [
        pytest.param("ads1115", "negate", True, id="a word with a sign"),
        pytest.param("ads1115", "swap", False, id="a word that is alone"),
        pytest.param("cmps12", "negate", True, id="a word with a sign among others"),
        pytest.param("srf08", "negate", False, id="words of no sign"),
    ],
)
def test_a_word_is_exchanged_with_a_neighbour_and_negated_where_it_has_one_or_a_sign(
    name: str, kind: str, *, fits: bool
) -> None:
    clock = ManualClock()
    chip = chip_double(name)
    assert chip.address is not None
    bus = I2cBusDouble("i2c1", clock, chip.on_bus(clock, chip.address))
    assert (kind in bus.fitting(chip.address)) == fits


def test_one_frozen_word_stays_and_the_others_live_on(awake: Robot) -> None:
    before = burst(awake)
    awake.faults(Strike("freeze-axis", "imu", amount=UP))
    for _ in range(5):
        awake.wait(SECOND // 10)
        now = burst(awake)
        assert now[UP] == before[UP]
    assert now[:UP] != before[:UP]


def test_a_noisy_word_changes_ten_times_more_than_what_is_measured() -> None:
    clock, bearing_deg = ManualClock(SECOND), [100.0]
    chip = Cmps12Double(clock, bearing_deg=lambda _at: bearing_deg[0])
    bus = I2cBusDouble("i2c1", clock, [chip])
    bus.strike("noise", chip.address, Span(0, NEVER, once=False), 0.0)
    read = []
    for bearing_deg[0] in (100.0, 103.0, 103.0, 101.0):
        clock.advance(SECOND)
        read.append(int.from_bytes(bus.transaction(chip.address, (b"\x02", 2))))
    assert read == [1000, 1300, 1030, 830]


def test_a_word_is_counted_round_and_stays_within_its_bits(awake: Robot) -> None:
    words = 9
    awake.faults(Strike("scale", "imu", amount=2 + words))
    awake.faults(Strike("scale", "imu", amount=2))
    awake.faults(Strike("scale", "imu", amount=2))
    assert burst(awake)[2] == 32767  # upwards: 1 g, eight times


def test_a_late_reading_is_the_one_before(awake: Robot) -> None:
    readings = [burst(awake)]
    awake.faults(Strike("late", "imu"))
    seen = []
    for _ in range(4):
        awake.wait(SECOND // 10)
        seen.append(burst(awake))
    awake.faults(ClearFaults())
    assert seen[0] == readings[0]
    assert len({tuple(each) for each in seen}) == 4


@pytest.mark.parametrize(
    ("kind", "number", "altered"),
    [
        ("flip", 0, b"\xf1"),
        ("flip", 7, b"\x70"),
        ("flip", 8, b"\xf1"),
        ("wrong-byte", 0, b"\x8e"),
        ("wrong-byte", 3, b"\x8e"),
    ],
)
def test_one_bit_or_one_byte_arrives_inverted(
    awake: Robot, kind: str, number: int, altered: bytes
) -> None:
    awake.faults(Strike(kind, "imu", for_s=0, amount=number))
    assert awake.read(0x68, WHO_AM_I) == altered
    assert awake.read(0x68, WHO_AM_I) == b"\x71"


def test_a_slow_bus_takes_its_time_on_the_clock_of_the_doubles() -> None:
    clock = ManualClock()
    chip = Pca9685Double(clock)
    bus = I2cBusDouble("i2c1", clock, [chip], reach=lambda at: clock.advance(at - clock()))
    took = []
    for _ in range(2):
        began = clock()
        bus.transaction(0x40, (b"\xfe", 1))
        took.append(clock() - began)
        bus.strike("slow", None, Span(0, NEVER, once=False), 2.0)
    assert took[1] == took[0] + 2 * MILLISECOND


def test_kinds_of_measured_words_fit_what_measures_and_nothing_else() -> None:
    with robot("tachobot") as tachobot:
        kinds = {place.name: place.kinds for place in tachobot.faults(ListFaults()).places}
    assert "offset" in kinds["imu"]
    assert "offset" in kinds["i2c1"]
    assert "offset" not in kinds["thrust_pairs"]
