"""Served lines, OE among them: the same bytes and errors as on a rig in this process."""

import errno
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.board import registry
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.served.client import (
    ServedBus,
    ServedDoubles,
    ServedEnableLine,
    ServedPort,
    look,
)
from firmware_runtime.hal.served.packets import Enable, Failed, Question, encode, read_answer
from firmware_runtime.hal.wire_errors import (
    EREMOTEIO,
    AddressInUse,
    BusAbsent,
    BusFault,
    HalError,
    PortClosed,
)
from sim_doubles.clock import ManualClock
from sim_doubles.faults import AdapterError, FaultScript
from sim_doubles.rigs.board_rig import DoublesRig, rig_for
from sim_doubles.rigs.tachobot import TachobotRig
from sim_doubles.serial_line import SerialLineDouble
from tests.support.served_rig import SERIAL_SONAR, SERIAL_TREADS, ServedRig, lines_of, served_rig

ADDRESSES = {
    "tachobot": (0x40, 0x41, 0x68, 0x0C, 0x70, 0x00, 0x23),
    "detective": (0x40, 0x58, 0x61, 0x62, 0x73, 0x75, 0x70, 0x00, 0x23),
}
MESSAGES = st.lists(st.binary(max_size=6) | st.integers(-1, 12), max_size=4)
SPANS = st.integers(0, 4 * MILLISECOND)
OF_ADAPTERS = (
    EREMOTEIO,
    errno.ENXIO,
    errno.EAGAIN,
    errno.ETIMEDOUT,
    errno.EBUSY,
    errno.EIO,
    errno.EPROTO,
)


def local_rig(board: str, *assignments: str) -> tuple[ManualClock, DoublesRig]:
    clock = ManualClock()
    return clock, rig_for(registry.load(board, assignments), clock)


def outcome(transaction: Callable[[], bytes]) -> bytes | tuple[type[HalError], str]:
    """What was read, or the error with its sentence."""
    try:
        return transaction()
    except HalError as error:
        return type(error), str(error)


@pytest.mark.slow
@pytest.mark.parametrize("board", sorted(ADDRESSES))
@settings(max_examples=15, deadline=None)
@given(data=st.data())
def test_random_transactions_end_as_on_the_bus_itself(board: str, data: st.DataObject) -> None:
    clock, doubles = local_rig(board)
    local = doubles.buses["i2c1"]
    asked = st.lists(st.tuples(SPANS, st.sampled_from(ADDRESSES[board]), MESSAGES), max_size=12)
    with served_rig(board) as rig:
        served = ServedBus("i2c1", rig.ask)
        for span, address, messages in data.draw(asked):
            clock.advance(span)
            rig.clock.advance(span)
            there = outcome(partial(served.transaction, address, messages))
            assert there == outcome(partial(local.transaction, address, messages))
        assert look(rig.ask).levels == doubles.levels(clock())


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.integers(0, SECOND),
            st.sampled_from(("treads", "sonar")),
            st.none() | st.binary(max_size=8),
        ),
        max_size=12,
    )
)
def test_random_serial_traffic_ends_as_on_the_port_itself(
    traffic: list[tuple[int, str, bytes | None]],
) -> None:
    board = ("detective", *SERIAL_TREADS, *SERIAL_SONAR)
    clock, doubles = local_rig(*board)
    with served_rig(*board) as rig:
        served = {name: ServedPort(name, rig.ask) for name in doubles.ports}
        for span, name, written in traffic:
            clock.advance(span)
            rig.clock.advance(span)
            if written is not None:
                doubles.ports[name].write(written)
                served[name].write(written)
            assert served[name].read_available() == doubles.ports[name].read_available()
        assert look(rig.ask).levels == doubles.levels(clock())


@pytest.fixture
def rig() -> Iterator[ServedRig]:
    with served_rig("detective", *SERIAL_TREADS, *SERIAL_SONAR) as rig:
        yield rig


@pytest.mark.parametrize("number", OF_ADAPTERS)
def test_every_errno_of_an_adapter_becomes_the_same_error(rig: ServedRig, number: int) -> None:
    _clock, doubles = local_rig("detective")
    local, served = doubles.buses["i2c1"], ServedBus("i2c1", rig.ask)
    local.faults = FaultScript([AdapterError(errno=number)])
    rig.doubles.buses["i2c1"].faults = FaultScript([AdapterError(errno=number)])
    messages: list[Message] = [b"\x00", 1]
    failed = outcome(lambda: served.transaction(0x40, messages))
    assert isinstance(failed, tuple)
    assert failed == outcome(lambda: local.transaction(0x40, messages))
    assert served.transaction(0x40, messages) == b"\x11"


def test_a_line_that_was_closed_is_closed_for_its_client_only(rig: ServedRig) -> None:
    bus, other_bus = ServedBus("i2c1", rig.ask), ServedBus("i2c1", rig.ask)
    port, other_port = ServedPort("treads", rig.ask), ServedPort("treads", rig.ask)
    bus.close()
    port.close()
    with pytest.raises(PortClosed, match="i2c1 0x40: used after"):
        bus.read(0x40, 1)
    with pytest.raises(PortClosed, match="treads: used after"):
        port.write(b"\xaa")
    assert other_bus.write_read(0x40, b"\x00", 1) == b"\x11"
    other_port.write(b"\xaa")
    assert other_port.read_available() == b""


def test_an_absent_line_and_an_adapter_pulled_out_are_errors_of_the_line(rig: ServedRig) -> None:
    with pytest.raises(BusAbsent, match="i2c9 0x40: no such device"):
        ServedBus("i2c9", rig.ask).read(0x40, 1)
    with pytest.raises(BusAbsent, match="radio: no such device"):
        ServedPort("radio", rig.ask)
    served, line = ServedPort("sonar", rig.ask), rig.doubles.ports["sonar"]
    assert isinstance(line, SerialLineDouble)
    line.unplugged = True
    with pytest.raises(BusFault, match="sonar"):
        served.read_available()


def test_what_arrived_before_a_port_was_opened_is_thrown_away(rig: ServedRig) -> None:
    rig.clock.advance(2 * SECOND)
    served = ServedPort("sonar", rig.ask)
    assert served.read_available() == b""
    rig.clock.advance(SECOND)
    assert b"R" in served.read_available()


def test_outputs_and_result_are_those_of_the_rig(rig: ServedRig) -> None:
    doubles = ServedDoubles(rig.ask, rig.doubles.buses, rig.doubles.ports)
    doubles.ports["treads"].write(bytes((0xAA, 128, 0, 127, 127)))
    rig.clock.advance(3 * SECOND)
    assert doubles.outputs == rig.doubles.outputs == {"radar_motor": 0, "treads": 1}
    reported = doubles.result(5 * SECOND, {"found": True})
    assert reported == rig.doubles.result(5 * SECOND, {"found": True})
    assert (reported["found"], reported["time_s"]) == (False, 5.0)


WIRED = ("output_enable.chip=/dev/gpiochip0", "output_enable.line=17")
FULL_ON = (b"\xfd\x00", b"\xfb\x10")


def drive(rig: ServedRig) -> None:
    """Wake the chip and switch all its outputs full-on."""
    bus = rig.doubles.buses["i2c1"]
    for message in (b"\x00\x21", *FULL_ON):
        bus.transaction(0x40, (message,))


def duty(rig: ServedRig) -> float:
    assert isinstance(rig.doubles, TachobotRig)
    return rig.doubles.thrust.duty(0)


def test_outputs_are_off_until_the_line_lets_them_through_and_when_it_is_given_up() -> None:
    with served_rig("tachobot", *WIRED) as rig:
        line = rig.doubles.enable
        assert line is not None
        drive(rig)
        assert duty(rig) == 0
        line.set(True)
        assert duty(rig) == 1
        line.set(False)
        assert duty(rig) == 0
        line.set(True)
        line.close()
        assert duty(rig) == 0
        with pytest.raises(PortClosed):
            line.set(True)


def test_a_served_line_that_was_given_up_lets_nothing_through_any_more() -> None:
    with served_rig("tachobot", *WIRED) as rig:
        drive(rig)
        line = ServedEnableLine("output_enable", rig.ask)
        line.set(True)
        assert duty(rig) == 1
        line.close()
        line.close()
        with pytest.raises(PortClosed, match="output_enable: used after"):
            line.set(True)
        assert duty(rig) == 0


def test_without_one_outputs_need_none() -> None:
    with served_rig("tachobot") as rig:
        drive(rig)
        assert (rig.doubles.enable, duty(rig)) == (None, 1)
        with pytest.raises(BusAbsent):
            ServedEnableLine("output_enable", rig.ask).set(True)


def test_a_client_that_goes_frees_the_line_and_the_log_has_it(tmp_path: Path) -> None:
    log = tmp_path / "doubles.log"
    with served_rig("tachobot", *WIRED, log=log) as rig:
        drive(rig)
        rig.service.answer(encode(Question(1, Enable(enabled=True))), client=3)
        assert duty(rig) == 1
        rig.service.release(4)
        assert duty(rig) == 1
        rig.service.release(3)
        assert duty(rig) == 0
    changes = [line["value"] for line in lines_of(log) if line.get("output") == "thrust_pairs.0"]
    assert changes == [1, 0]


def test_a_line_that_another_client_holds_is_refused_until_it_goes() -> None:
    with served_rig("tachobot", *WIRED) as rig:
        rig.service.answer(encode(Question(1, Enable(enabled=True))), client=3)
        asked = encode(Question(2, Enable(enabled=False)))
        assert read_answer(rig.service.answer(asked, client=4)).answered == Failed(errno.EBUSY)
        with pytest.raises(AddressInUse):
            ServedEnableLine("output_enable", rig.ask).set(False)
        rig.service.release(3)
        ServedEnableLine("output_enable", rig.ask).set(False)
