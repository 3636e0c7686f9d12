"""Recorded lines answer in the recorded order; what is asked otherwise is refused or said."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import pytest

from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Lines
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.served.client import ServedBus, ServedDoubles, ServedPort, look
from firmware_runtime.hal.served.packets import (
    Answered,
    Asked,
    Question,
    encode,
    read_answer,
)
from firmware_runtime.hal.served.strikes import ask_faults
from firmware_runtime.hal.strike import Strike
from firmware_runtime.hal.wire_errors import EREMOTEIO, BusAbsent, BusFault, HalError, from_os_error
from firmware_runtime.recording.blackbox.layout import Chunk, file_of
from firmware_runtime.recording.blackbox.reader import Recording, kind_of, read_recording
from firmware_runtime.recording.blackbox.section import DISCARD, READ, WRITE, Kind, Transfer
from firmware_runtime.recording.board_of_recording import board_of_table
from firmware_runtime.runs import hardware
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session
from sim_doubles.recorded import stops
from sim_doubles.recorded.lines import RecordedPort, Rules
from sim_doubles.recorded.service import RecordedService
from sim_doubles.recorded.stops import stops_of
from sim_doubles.recorded.traffic import Deviation, Deviations, Traffic, traffic_of
from tests.support.recorded import every_section, in_chunks, record
from tests.support.served_rig import SERIAL_SONAR, SERIAL_TREADS


@dataclass
class Served:
    """A recording's lines; `said` has the deviations in sentences."""

    recording: Recording
    traffic: Traffic
    deviations: Deviations
    service: RecordedService
    reported: list[Deviation]
    client: int = 1
    over: list[str] = field(default_factory=list)

    def ask(self, asked: Asked, _where: str) -> Answered:
        answer = read_answer(self.service.answer(encode(Question(7, asked)), self.client))
        assert answer.number == 7
        return answer.answered


def served(
    path: Path, *, is_strict: bool = True, lines: Collection[str] = (), begin: int = 0
) -> Served:
    """Serve the recording at a path."""
    recording = read_recording(path)
    traffic = traffic_of(recording, lines, begin)
    reported: list[Deviation] = []
    deviations = Deviations(reported.append)
    rules = Rules(is_strict, stops_of(recording), deviations)
    service = RecordedService(recording.header.board, traffic, rules)
    found = Served(recording, traffic, deviations, service, reported)
    service.over = lambda: found.over.append("over")
    service.left = lambda: found.over.append("left")
    return found


OFF = b"\xfd\x10"
"""The full-off of a PCA9685: ALL_LED_OFF_H."""


def break_every_seventh(session: Session) -> None:
    """Let a transaction fail now and then."""
    assert session.hardware.rig is not None
    bus = session.hardware.rig.buses["i2c1"]
    carry, count = bus.transaction, iter(range(1_000_000))

    def sometimes(address: int, messages: Sequence[Message]) -> bytes:
        if next(count) % 7 == 3:
            raise from_os_error(OSError(EREMOTEIO, "no"), f"i2c1 0x{address:02x}")
        return carry(address, messages)

    bus.transaction = sometimes  # type: ignore[method-assign]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of three runs, in virtual time."""
    folder = tmp_path_factory.mktemp("recordings")
    record(folder / "tachobot", "tachobot", 0.2)
    record(folder / "failing", "tachobot", 0.2, before=break_every_seventh)
    record(folder / "serial", "detective", 0.7, (*SERIAL_TREADS, *SERIAL_SONAR))
    return folder


def outcome(bus: ServedBus, transfer: Transfer) -> object:
    try:
        return bus.transaction(transfer.address, transfer.messages)
    except HalError as error:
        return type(error).__name__, str(error)


def i2c(lines: Served) -> ServedBus:
    return ServedBus("i2c1", lines.ask)


def recorded(lines: Served, name: str = "i2c1") -> list[Transfer]:
    return [each.transfer for each in lines.traffic.lines[name]]


@pytest.mark.parametrize("run", ["tachobot", "failing"])
def test_what_is_asked_as_recorded_ends_as_recorded_failures_too(runs: Path, run: str) -> None:
    lines = served(runs / run)
    bus = i2c(lines)
    for each in recorded(lines):
        assert lines.over == []
        answer = each.answer if isinstance(each.answer, bytes) else tuple(each.answer)
        assert outcome(bus, each) == answer
    assert any(each.failed for each in recorded(lines)) == (run == "failing")
    assert (lines.deviations.count, lines.over, lines.service.next_number) == (0, ["over"], None)
    lines.service.release(1)
    assert lines.over == ["over", "left"]


def test_what_is_wrong_is_refused_and_what_is_due_stays_due(runs: Path) -> None:
    lines = served(runs / "tachobot")
    bus = i2c(lines)
    first, second, third, *_ = recorded(lines)
    outcome(bus, first)
    outcome(bus, second)
    for _ in range(3):  # retries are said once
        with pytest.raises(BusFault, match="EPROTO"):
            bus.transaction(0x40, [b"\x00\x21"])
    (said,) = lines.reported
    assert lines.deviations.count == 3
    assert (said.due and said.due.number, said.due and said.due.transfer) == (3, third)
    assert "recorded W 0020, asked i2c1 0x40 W 0021; refused" in str(said)
    assert outcome(bus, third) == third.answer


def test_what_comes_early_is_refused_or_answered_by_its_own(runs: Path) -> None:
    strict, lenient = served(runs / "tachobot"), served(runs / "tachobot", is_strict=False)
    identity = next(each for each in recorded(strict) if each.address == 0x68)
    with pytest.raises(BusFault):
        i2c(strict).transaction(0x68, identity.messages)
    assert strict.service.next_number == 1
    assert i2c(lenient).transaction(0x68, identity.messages) == identity.answer
    (said,) = lenient.reported
    number = recorded(lenient).index(identity) + 1
    assert said.done == f"answered by transaction {number}"
    assert lenient.service.next_number == number + 1


def test_one_passed_over_can_be_asked_for_later_and_all_goes_on_from_there(runs: Path) -> None:
    lines = served(runs / "tachobot", is_strict=False)
    bus = i2c(lines)
    with pytest.raises(BusFault):  # where nothing like it is left it is refused at any rate
        bus.transaction(0x23, [b"\x00", 1])
    first, second, third, fourth, *others = recorded(lines)
    for each in (first, second, fourth, third, *others):
        assert outcome(bus, each) == each.answer
    done = ["refused", "answered by transaction 4", "answered by transaction 3"]
    assert [each.done for each in lines.reported] == done
    assert lines.over == ["over"]


def test_after_the_end_only_what_switches_off_is_answered(runs: Path) -> None:
    lines = served(runs / "tachobot")
    bus = i2c(lines)
    for each in recorded(lines):
        outcome(bus, each)
    with pytest.raises(BusFault):
        bus.transaction(0x68, [b"\x75", 1])
    bus.write(0x40, OFF)
    assert [each.due for each in lines.reported] == [None, None]
    assert [each.done for each in lines.reported] == ["refused", "answered, as it switches off"]


def test_a_stop_is_never_refused_though_the_run_was_killed_before_its_own(
    runs: Path, tmp_path: Path
) -> None:
    recording = read_recording(runs / "tachobot")
    killed = tmp_path / "killed"
    before = [each for each in every_section(runs / "tachobot") if kind_of(each) < Kind.SAFE]
    killed.write_bytes(file_of([Chunk(1, [recording.chunks[0].contents[0], *before])]))
    assert all(
        each.kind is not Kind.SAFE for each in read_recording(killed).segments()[0].sections()
    )
    lines = served(killed)
    bus = i2c(lines)
    bus.write(0x40, OFF)
    assert (lines.deviations.count, lines.service.next_number) == (1, 1)


def test_switching_off_after_a_failure_may_read_and_is_answered(runs: Path) -> None:
    stops = stops_of(read_recording(record(runs / "wheels", "detective", 0.05)))
    reads = [key for key in stops if any(isinstance(each, int) for each in key[2])]
    assert ("i2c1", 0x58, (b"\x0f", 1)) in reads  # an MD25's mode, which decides how it is stopped


class Wary:
    """Switches its chip off, in another way once that has failed."""

    def __init__(self, lines: Lines) -> None:
        self._bus, self._off = lines.buses["i2c1"], b"\x01"

    def make_safe(self) -> None:
        try:
            self._bus.write(0x40, self._off)
        except BusFault:
            self._off = b"\x02"


def test_what_a_robot_asks_for_only_after_a_failure_switches_off_too(
    runs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    board = SimpleNamespace(settings=SimpleNamespace(buses=["i2c1"]), ports=[], build=Wary)
    monkeypatch.setattr(stops, "board_of", lambda _header: board)
    found = stops_of(read_recording(runs / "tachobot"))
    assert {("i2c1", 0x40, (b"\x01",)), ("i2c1", 0x40, (b"\x02",))} <= found.keys()


def test_lines_that_were_not_chosen_are_absent(runs: Path) -> None:
    lines = served(runs / "serial", lines=["treads"])
    assert set(lines.traffic.lines) == {"treads"}
    with pytest.raises(BusAbsent):
        i2c(lines).transaction(0x40, [OFF])
    with pytest.raises(ConfigError, match="i2c7: no line of this run; expected one of i2c1"):
        served(runs / "serial", lines=["i2c7"])


def test_from_an_instant_on_what_was_before_is_left_out(runs: Path) -> None:
    lines = served(runs / "tachobot", begin=SECOND // 10)
    whole = recorded(served(runs / "tachobot"))
    assert recorded(lines) == [each for each in whole if each.at >= SECOND // 10]
    assert 0 < lines.traffic.total < len(whole)
    with pytest.raises(ConfigError, match="nothing went over these lines"):
        served(runs / "tachobot", begin=SECOND)


@pytest.mark.slow
def test_a_recording_that_was_written_round_begins_at_a_keyframe(tmp_path: Path) -> None:
    path = record(tmp_path / "long", "tachobot", 5.5)
    keyframe = next(
        place
        for place, each in enumerate(every_section(path))
        if kind_of(each) == Kind.KEYFRAME and place > 100
    )
    content = in_chunks(path, 20)
    path.write_bytes(content)
    chunks = [Chunk(each.number, each.contents) for each in read_recording(path).chunks]
    path.write_bytes(file_of(chunks[keyframe // 20 - 1 :]))
    lines = served(path)
    (segment,) = lines.recording.segments()
    assert not lines.recording.is_from_start
    assert recorded(lines)[0].at >= segment.first_at > SECOND


# Serial ports ------------------------------------------------------------------------------------


@pytest.fixture
def serial(runs: Path) -> Served:
    return served(runs / "serial", lines=["treads", "sonar"])


def test_a_port_gives_its_bytes_in_their_place_and_compares_what_is_written(serial: Served) -> None:
    ports = {name: ServedPort(name, serial.ask) for name in ("treads", "sonar")}
    written = arrived = 0
    for name, port in ports.items():
        for each in recorded(serial, name):
            assert serial.over == [] or not each.answer
            if each.address == WRITE:
                assert serial.over == []
                port.write(each.messages)
                written += 1
            else:
                assert port.read_available() == (b"" if each.address == DISCARD else each.answer)
                arrived += len(each.answer)
    assert written > 3
    assert arrived > 3
    assert (serial.deviations.count, serial.over) == (0, ["over"])


def test_polls_more_or_less_are_no_deviation_and_lose_no_byte(serial: Served) -> None:
    port = ServedPort("sonar", serial.ask)
    found = b"".join(port.read_available() for _ in range(2 * len(recorded(serial, "sonar"))))
    assert found == b"".join(e.answer for e in recorded(serial, "sonar") if e.address == READ)
    assert port.read_available() == b""
    treads = ServedPort("treads", serial.ask)
    for each in recorded(serial, "treads"):
        if each.address == WRITE:
            treads.write(each.messages)
    assert serial.deviations.count == 0


def test_another_write_is_refused_and_a_stop_is_taken(serial: Served) -> None:
    port = ServedPort("treads", serial.ask)
    due = next(each for each in recorded(serial, "treads") if each.address == WRITE)
    with pytest.raises(BusFault):
        port.write(b"Dear Sir")
    stop = next(key for key in stops_of(serial.recording) if key[0] == "treads")
    port.write(bytes(stop[2]))  # type: ignore[arg-type] # of a port these are bytes
    done = [each.done for each in serial.reported]
    assert done[0] == "refused"
    assert due.messages.hex() in str(serial.reported[0])
    port.write(due.messages)


def test_a_port_on_which_nothing_passed_is_over_from_the_start(serial: Served) -> None:
    rules = Rules(is_strict=True, stops=stops_of(serial.recording), deviations=serial.deviations)
    assert RecordedPort("sonar", [], rules).is_over


def test_a_second_client_that_opens_a_port_and_goes_takes_no_bytes_with_it(
    serial: Served,
) -> None:
    own = ServedPort("sonar", serial.ask)
    serial.client = 2
    ServedPort("sonar", serial.ask)
    serial.client = 1
    serial.service.release(2)
    every = range(len(recorded(serial, "sonar")))
    found = b"".join(own.read_available() for _ in every)
    assert found == b"".join(e.answer for e in recorded(serial, "sonar") if e.address == READ)


# The rest of what a client asks ------------------------------------------------------------------


def test_it_stands_for_the_board_and_takes_no_fault(runs: Path) -> None:
    lines = served(runs / "tachobot")
    assert look(lines.ask).board == "tachobot"
    doubles = ServedDoubles(lines.ask, ["i2c1"], [], has_enable_line=True)
    assert doubles.enable is not None
    doubles.enable.set(True)
    assert doubles.result(SECOND, {"found": False}) == {"found": False}
    with pytest.raises(ConfigError, match="a recording"):
        ask_faults(lines.ask, Strike("nack", "i2c1"))


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "pan_tilt", "detective"])
def test_the_same_robot_asks_for_every_transaction_as_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, board: str
) -> None:
    path = record(tmp_path / board, board, 0.5)
    lines = served(path)
    header = lines.recording.header

    def doubles(board: Board, _path: Path, **_: object) -> ServedDoubles:
        return ServedDoubles(lines.ask, board.settings.buses, board.ports)

    monkeypatch.setattr(hardware, "served_doubles", doubles)
    found = board_of_table(header.source, header.table)
    session = start_session(found, VirtualClock(), doubles=tmp_path / "none", statistics_path=None)
    session.run(SECOND // 2)
    session.close()
    assert [str(each) for each in lines.reported] == []
    assert lines.over == ["over"]
