"""A USB I2C adapter of doubles, spoken to as the kernel does: URBs as bytes."""

import errno
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.board import registry
from firmware_runtime.hal.budget import transaction_ns
from firmware_runtime.hal.i2c import Message
from sim_doubles.clock import ManualClock
from sim_doubles.rigs.board_rig import rig_for
from sim_doubles.usbip.i2c_tiny_usb import FUNCTIONALITY, PRODUCT, VENDOR, I2cTinyUsb
from sim_doubles.usbip.packets import Conversation
from sim_doubles.usbip.plugged import transfer_of
from tests.support.served_rig import ServedRig, lines_of, served_rig
from tests.support.usbip_host import (
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


def test_another_endpoint_stalls(rig: ServedRig) -> None:
    conversation = Conversation(I2cTinyUsb("x", transfer_of(rig.service, "i2c1")))
    sent = submit((VENDOR_IN, GET_FUNCTIONALITY, 0, 0, 4), endpoint=1)
    assert answers(conversation.receive(sent))[0].status == -errno.EPIPE


def test_functionality_is_plain_transfers_and_emulated_smbus(host: Host) -> None:
    assert host.read(GET_FUNCTIONALITY, 0, 0, 4).read == FUNCTIONALITY.to_bytes(4, "little")
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
@settings(max_examples=40, deadline=None)
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
                expected = errno.ENXIO if error.errno == errno.EREMOTEIO else errno.EIO
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
