"""The stream that carries USB/IP: pieces of any size, what is cut short, what is no request."""

import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_doubles.usbip.i2c_tiny_usb import FUNCTIONALITY, I2cTinyUsb, Piece
from sim_doubles.usbip.packets import HEADER, Conversation, NotAttached, NotUsbip
from sim_doubles.usbip.plugged import PluggedBus, transfer_of
from tests.support.served_rig import ServedRig, served_rig
from tests.support.usbip_host import (
    ACKNOWLEDGED,
    FIRST,
    GET_FUNCTIONALITY,
    GET_STATUS,
    LAST,
    PWM,
    TRANSFER,
    VENDOR_IN,
    VENDOR_OUT,
    answers,
    submit,
    unlink,
)


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[ServedRig]:
    with served_rig("tachobot", log=tmp_path / "log") as rig:
        yield rig


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


def test_a_request_cut_short_is_not_carried_out(rig: ServedRig) -> None:
    conversation = of_rig(rig)
    whole = submit((VENDOR_OUT, TRANSFER + FIRST + LAST, 0, PWM, 2), b"\x00\x21")
    assert conversation.receive(whole[:-1]) == b""
    assert rig.doubles.buses["i2c1"].transactions == 0


def test_a_request_withdrawn_was_answered_before(rig: ServedRig) -> None:
    conversation = of_rig(rig)
    (answer,) = answers(conversation.receive(unlink(9, 8)))
    assert (answer.command, answer.number, answer.status) == (4, 9, 0)


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
