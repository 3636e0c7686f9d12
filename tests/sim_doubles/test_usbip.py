"""A USB I2C adapter of doubles, spoken to as the kernel does: URBs, their stream, sysfs."""

import errno
import struct
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from socket import socketpair
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.board import registry
from firmware_runtime.cli.main import main
from firmware_runtime.hal.budget import transaction_ns
from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.wire_errors import EREMOTEIO
from firmware_runtime.system.programs import Ended
from sim_doubles.clock import ManualClock
from sim_doubles.rigs.board_rig import rig_for
from sim_doubles.usbip import host_controller
from sim_doubles.usbip.host_controller import HostController
from sim_doubles.usbip.i2c_tiny_usb import FUNCTIONALITY, PRODUCT, VENDOR, I2cTinyUsb, Piece
from sim_doubles.usbip.packets import HEADER, Conversation, NotAttached, NotUsbip
from sim_doubles.usbip.plugged import PluggedBus, transfer_of
from tests.support.served_rig import ServedRig, lines_of, served_rig
from tests.support.usbip_host import (
    ACKNOWLEDGED,
    FIRST,
    FREE,
    GET_FUNCTIONALITY,
    GET_STATUS,
    LAST,
    PWM,
    REFUSED,
    SENSOR,
    TRANSFER,
    VENDOR_IN,
    VENDOR_OUT,
    Host,
    answers,
    host_of,
    submit,
    unlink,
)


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[ServedRig]:
    with served_rig("tachobot", log=tmp_path / "log") as rig:
        yield rig


@pytest.fixture
def host(rig: ServedRig) -> Host:
    return host_of(rig)


# What the kernel asks when a device is plugged in ------------------------------------------------


DEVICE, CONFIGURATION, TEXT = 0x0100, 0x0200, 0x0300


def descriptor(host: Host, which: int, length: int, language: int = 0) -> bytes:
    return host.ask((0x80, 6, which, language, length)).read


def test_the_device_is_the_one_that_linux_has_a_driver_for(host: Host) -> None:
    device = descriptor(host, DEVICE, 18)
    assert len(device) == device[0] == 18
    assert device[1:8] == b"\x01\x10\x01\xff\x00\x00\x40"  # USB 1.1, of the vendor's class
    assert struct.unpack_from("<HH", device, 8) == (VENDOR, PRODUCT) == (0x0403, 0xC631)
    assert len(descriptor(host, DEVICE, 8)) == 8
    text = descriptor(host, TEXT + device[16], 255, 0x0409)
    assert text[0] == len(text)
    assert text[2:].decode("utf-16-le") == "tachobot.i2c1"  # board and bus


def test_the_configuration_says_how_long_it_is(host: Host) -> None:
    (total,) = struct.unpack_from("<H", descriptor(host, CONFIGURATION, 9), 2)
    whole = descriptor(host, CONFIGURATION, total)
    lengths, at = [], 0
    while at < total:
        lengths.append(whole[at])
        at += whole[at]
    assert (lengths, at) == ([9, 9], total == len(whole) and total)
    assert whole[:9] == b"\x09\x02\x12\x00\x01\x01\x00\x80\x32"  # 100 mA of the bus
    assert whole[9:] == b"\x09\x04\x00\x00\x00\xff\x00\x00\x00"  # no endpoint but the first


@pytest.mark.parametrize(
    ("setup", "status"),
    [
        *((setup, 0) for setup in ((0x00, 9, 1, 0, 0), (0x01, 11, 0, 0, 0), (0x41, 2, 10, 0, 0))),
        *((setup, -errno.EPIPE) for setup in ((0x80, 6, 0x0600, 0, 10), (0xC1, 9, 0, 0, 1))),
        ((0xA1, 1, 0, 0, 1), -errno.EPIPE),
    ],
)
def test_configuration_interface_and_delay_are_taken_and_what_is_not_known_stalls(
    host: Host, setup: Sequence[int], status: int
) -> None:
    assert host.ask(setup).status == status
    functions = host.read(GET_FUNCTIONALITY, 0, 0, 4).read
    assert functions == FUNCTIONALITY.to_bytes(4, "little")
    assert FUNCTIONALITY & 1
    assert not FUNCTIONALITY & 0x0100_0000, "block reads need a length that comes while reading"


# Transactions ------------------------------------------------------------------------------------

ADDRESSES = (PWM, 0x41, SENSOR, 0x0C, 0x70, 0x00, FREE)
WRITES = st.lists(st.binary(min_size=1, max_size=6), max_size=2)
TRANSACTIONS = st.builds(
    lambda writes, read: (*writes, *read),
    WRITES,
    st.lists(st.integers(1, 12), max_size=1),
).filter(bool)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 4_000_000), st.sampled_from(ADDRESSES), TRANSACTIONS)))
def test_random_transactions_end_as_on_the_doubles_used_directly(asked: Any) -> None:
    clock = ManualClock()
    local = rig_for(registry.load("tachobot", ()), clock).buses["i2c1"]
    with served_rig("tachobot") as rig:
        host = host_of(rig)
        for span, address, messages in asked:
            clock.advance(span)
            rig.clock.advance(span)
            try:
                expected: bytes | int = local.transfer(address, messages)
            except OSError as error:
                expected = errno.ENXIO if error.errno == EREMOTEIO else errno.EIO
            assert host.transaction(address, messages) == expected


def test_messages_of_one_transaction_happen_at_once(rig: ServedRig, host: Host) -> None:
    host.ask((VENDOR_OUT, TRANSFER + FIRST, 0, PWM, 1), b"\x00")
    bus = rig.doubles.buses["i2c1"]
    assert bus.transactions == 0
    host.read(TRANSFER + LAST, 1, PWM, 1)
    assert bus.transactions == 1
    assert bus.log[-1].messages == (b"\x00", 1)


def test_an_absent_address_is_refused_and_reads_zeros(host: Host) -> None:
    assert host.read(TRANSFER + FIRST + LAST, 1, FREE, 3).read == bytes(3)
    assert host.read(GET_STATUS, 0, 0, 1).read == REFUSED
    assert host.transaction(PWM, (b"\x00", 1)) == b"\x11", "and the next one goes well"
    assert host.transaction(PWM, (b"",)) == b"", "a quick write asks who is there"
    assert host.transaction(FREE, (b"",)) == errno.ENXIO


@pytest.mark.parametrize("messages", [(1, b"\x75"), (1, 1)])
def test_behind_a_pis_adapter_a_read_that_is_not_last_stalls_and_nothing_happens(
    rig: ServedRig, host: Host, messages: Sequence[Message]
) -> None:
    assert host.transaction(SENSOR, messages) == errno.EIO
    assert rig.doubles.buses["i2c1"].bytes == 0


@pytest.mark.parametrize(
    ("messages", "found"),
    [
        ((b"\x75", 1, b"\x19", 2), b"\x71\x00\x00"),
        ((b"\x74", 1, 1, b"\x75", 1), b"\x00\x00\x71"),
        ((1, 1), b"\x97\x9a"),  # the pointer goes on
    ],
)
def test_behind_its_own_a_read_may_be_anywhere(
    rig: ServedRig, host: Host, messages: Sequence[Message], found: bytes
) -> None:
    rig.doubles.buses["i2c1"].be_behind("i2c-tiny-usb")
    assert host.transaction(SENSOR, messages) == found


def test_pieces_of_a_transaction_are_joined_by_a_repeated_start(rig: ServedRig, host: Host) -> None:
    """Samples are frozen until STOP, so both reads are of one sample."""
    bus = rig.doubles.buses["i2c1"]
    bus.be_behind("i2c-tiny-usb")
    host.transaction(SENSOR, (b"\x19\x00\x01",))
    rig.clock.advance(200_000_000)
    host.read(TRANSFER + FIRST, 1, SENSOR, 2)
    rig.clock.advance(50_000_000)
    host.ask((VENDOR_OUT, TRANSFER, 0, SENSOR, 1), b"\x3a")
    assert host.read(TRANSFER, 1, SENSOR, 1).read == b"\x01", "a sample is there"
    rig.clock.advance(50_000_000)
    host.ask((VENDOR_OUT, TRANSFER, 0, SENSOR, 1), b"\x3a")
    assert host.read(TRANSFER + LAST, 1, SENSOR, 1).read == b"\x00", "and no new one"
    assert host.transaction(SENSOR, (b"\x3a", 1)) == b"\x01"


def test_what_comes_after_a_refusal_begins_with_a_start() -> None:
    pieces: list[Piece] = []

    def transfer(piece: Piece) -> bytes:
        pieces.append(piece)
        ((address, length),) = piece.messages
        if address == FREE or not isinstance(length, int):
            raise OSError(EREMOTEIO, "refused")
        return bytes(length)

    host = Host(Conversation(I2cTinyUsb("x", transfer)))
    for address in (SENSOR, FREE, SENSOR):
        host.read(TRANSFER + FIRST * (not pieces), 1, address, 1)
    assert [piece.continues for piece in pieces] == [False, True, False]


def test_messages_of_one_transaction_may_go_to_several_addresses(
    rig: ServedRig, host: Host
) -> None:
    host.ask((VENDOR_OUT, TRANSFER + FIRST, 0, PWM, 2), b"\x05\xe2")
    host.ask((VENDOR_OUT, TRANSFER, 0, SENSOR, 1), b"\x75")
    assert host.read(TRANSFER + LAST, 1, SENSOR, 1).read == b"\x71"
    assert rig.doubles.buses["i2c1"].transactions == 1
    assert host.transaction(PWM, (b"\x05", 1)) == b"\xe2"


def test_a_transaction_that_is_held_ends_when_another_comes(rig: ServedRig, host: Host) -> None:
    rig.doubles.buses["i2c1"].be_behind("i2c-tiny-usb")
    host.read(TRANSFER + FIRST, 1, SENSOR, 2)
    assert host.transaction(PWM, (b"\x00", 1)) == b"\x11"
    assert host.transaction(SENSOR, (b"\x75", 1)) == b"\x71"


def test_the_log_has_what_went_on_through_the_adapter(host: Host, tmp_path: Path) -> None:
    said = (b"\x00\x21", b"\x06\x00\x00\x00\x08", b"\xfd\x10")
    for message in said:
        host.transaction(PWM, (message,))
    on_the_wire = sum(transaction_ns((message,), 400_000) for message in said)
    changes = [line for line in lines_of(tmp_path / "log") if "output" in line]
    assert [(line["t_ns"], line["value"]) for line in changes][-1] == (on_the_wire, 0.0)
    assert {line["output"] for line in changes} == {"thrust_pairs.0"}


def of_rig(rig: ServedRig) -> Conversation:
    return Conversation(I2cTinyUsb("x", transfer_of(rig.service, "i2c1")))


@given(st.lists(st.integers(1, 40)))
def test_requests_may_come_in_pieces_of_any_size(sizes: list[int]) -> None:
    written: list[Piece] = []

    def transfer(piece: Piece) -> bytes:
        written.append(piece)
        return b""

    conversation = Conversation(I2cTinyUsb("x", transfer))
    stream = submit((VENDOR_OUT, TRANSFER + FIRST + LAST, 0, PWM, 5), b"12345", 1)
    stream += submit((VENDOR_IN, GET_STATUS, 0, 0, 1), number=2)
    sent = b""
    for size in sizes:
        sent += conversation.receive(stream[:size])
        stream = stream[size:]
    sent += conversation.receive(stream)
    assert written == [(((PWM, b"12345"),), False, False)]
    first, second = sent[: HEADER.size], sent[HEADER.size :]
    assert answers(first, reads=False)[0].number == 1
    assert answers(second)[0].read == ACKNOWLEDGED


@pytest.mark.parametrize(
    ("bytes_", "sentence"),
    [
        (struct.pack(">5I28x", 7, 1, 1, 0, 0), "command 7, expected 1 or 2"),
        (struct.pack(">5IIi20x", 1, 1, 1, 0, 0, 0, 70_000), "70000 bytes, expected 0 to 65535"),
        (struct.pack(">5IIi20x", 1, 1, 1, 0, 0, 0, -1), "-1 bytes"),
    ],
)
def test_what_is_no_request_is_refused_in_a_sentence(bytes_: bytes, sentence: str) -> None:
    conversation = Conversation(I2cTinyUsb("x", lambda _piece: b""))
    with pytest.raises(NotUsbip, match=sentence):
        conversation.receive(bytes_)


def test_requests_to_another_endpoint_cut_short_or_withdrawn(rig: ServedRig) -> None:
    conversation = of_rig(rig)
    sent = submit((VENDOR_IN, GET_FUNCTIONALITY, 0, 0, 4), endpoint=1)
    assert answers(conversation.receive(sent))[0].status == -errno.EPIPE
    (answer,) = answers(conversation.receive(unlink(9, 8)))
    assert (answer.command, answer.number, answer.status) == (4, 9, 0)
    whole = submit((VENDOR_OUT, TRANSFER + FIRST + LAST, 0, PWM, 2), b"\x00\x21")
    assert conversation.receive(whole[:-1]) == b""
    assert rig.doubles.buses["i2c1"].transactions == 0


@settings(deadline=None)
@given(st.binary(max_size=200))
def test_no_bytes_break_it_otherwise(noise: bytes) -> None:
    conversation = Conversation(I2cTinyUsb("x", lambda _piece: b""))
    with suppress(NotUsbip):
        assert len(answers(conversation.receive(noise), reads=False)) <= len(noise) // HEADER.size


def test_a_bus_answers_on_its_socket_until_the_kernel_lets_go(rig: ServedRig) -> None:
    bus = PluggedBus("tachobot.i2c1", transfer_of(rig.service, "i2c1"))
    with bus.connection, bus.kernels_end as kernel:
        kernel.sendall(submit((VENDOR_IN, GET_FUNCTIONALITY, 0, 0, 4)))
        bus.serve()
        assert answers(kernel.recv(100))[0].read == FUNCTIONALITY.to_bytes(4, "little")
        kernel.close()
        with pytest.raises(NotAttached, match=r"tachobot\.i2c1: the kernel let go"):
            bus.serve()


HEAD = "hub port sta spd dev      sockfd local_busid\n"
TAKEN = "hs  0000 006 002 00010002 000003 1-1\n"
FREE_PORT = "hs  0001 004 000 00000000 000000 0-0\n"
FREE_SUPER_SPEED = "ss  0008 004 000 00000000 000000 0-0\n"


def controller(folder: Path, *ports: str) -> HostController:
    (folder / "status").write_text(HEAD + "".join(ports))
    (folder / "attach").touch()
    (folder / "detach").touch()
    return HostController(folder)


def test_a_device_is_attached_to_the_first_free_port(tmp_path: Path) -> None:
    ours, theirs = socketpair()
    with ours, theirs:
        port = controller(tmp_path, TAKEN, FREE_PORT, FREE_SUPER_SPEED).attach(theirs, 7)
        assert (tmp_path / "attach").read_text() == f"1 {theirs.fileno()} 7 2"
        controller(tmp_path, TAKEN).detach(0)
        assert (tmp_path / "detach").read_text() == "0"
        with pytest.raises(NotAttached, match="no port is free"):
            controller(tmp_path, TAKEN, FREE_SUPER_SPEED).attach(theirs, 1)
        none = HostController(tmp_path / "none")
        with pytest.raises(NotAttached, match="expected root and the module vhci-hcd"):
            none.attach(theirs, 1)
        none.detach(1)
    assert port == 1


def test_the_device_node_is_that_of_the_port(tmp_path: Path) -> None:
    hub = tmp_path / "usb1"
    for port, bus in (("1-1", "i2c-3"), ("1-2", "i2c-9")):
        (hub / port / f"{port}:1.0" / bus / "i2c-dev" / bus).mkdir(parents=True)
    found = controller(tmp_path)
    assert found.i2c_device(0) == Path("/dev/i2c-3")
    assert found.i2c_device(1) == Path("/dev/i2c-9")
    assert found.i2c_device(2) is None


def test_a_kernel_without_the_modules_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(host_controller, "run_program", lambda _: Ended(1, "", "not found"))
    assert main(["doubles", "serve", "--usbip", "tachobot"]) == 2
    assert "not found; expected root, and a kernel with the modules" in capsys.readouterr().err


def test_serial_ports_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    treads = ("driver=sabertooth", "port=treads", "address=128", "refresh_s=0.2", "timeout_s=1.0")
    words = [f"treads.{each}" for each in treads]
    words += ["ports.treads.device=/dev/no/treads", "ports.treads.baud=9600"]
    options = [option for word in words for option in ("--set", word)]
    assert main(["doubles", "serve", "--usbip", "detective", *options]) == 2
    assert "ports.treads: a serial port, expected I2C buses only" in capsys.readouterr().err
