"""The real smbus2 with its real ctypes messages; only the kernel behind `ioctl` is replaced."""

import ctypes
import errno
import gc
import os
from collections.abc import Iterator
from contextlib import closing
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType

import pytest
import smbus2.smbus2

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal import i2c, linux, unopened_lines, wire_errors
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.linux import check_node
from firmware_runtime.hal.wire_errors import (
    EREMOTEIO,
    AddressInUse,
    ArbitrationLost,
    BusAbsent,
    BusFault,
    BusInUse,
    BusTimeout,
    Fault,
    HalError,
    NoAcknowledge,
    PortClosed,
    Stuck,
    errno_of,
    from_os_error,
)

I2C_M_RD = 0x0001
I2C_FUNC_I2C = 0x00000001
I2C_FUNC_SMBUS_BYTE = 0x00060000


class Message(ctypes.Structure):
    """`struct i2c_msg` as the kernel lays it out."""

    _fields_ = (
        ("addr", ctypes.c_uint16),
        ("flags", ctypes.c_uint16),
        ("len", ctypes.c_uint16),
        ("buf", ctypes.c_void_p),
    )
    addr: int
    flags: int
    len: int
    buf: int


class Transfer(ctypes.Structure):
    """`struct i2c_rdwr_ioctl_data` as the kernel lays it out."""

    _fields_ = (("msgs", ctypes.POINTER(Message)), ("nmsgs", ctypes.c_uint32))
    msgs: list[Message]
    nmsgs: int


class Kernel:
    """What stands behind `/dev/i2c-N`: answers ioctls, remembers what went over the wire."""

    def __init__(self) -> None:
        self.functions = I2C_FUNC_I2C
        self.timeout_10ms = 100
        self.claims: list[int] = []
        self.held_by_a_driver: set[int] = set()
        self.unplugged = False
        self.wire: list[list[tuple[int, bytes | int]]] = []
        self.answers: list[bytes] = []
        self.failure: int | None = None

    def ioctl(
        self, descriptor: int, request: int, argument: ctypes.Structure | ctypes.c_ulong | int
    ) -> int:
        os.fstat(descriptor)  # a closed descriptor is EBADF, as in the kernel
        if request == 0x0705 and isinstance(argument, ctypes.c_ulong):
            argument.value = self.functions
        elif request == 0x0702 and isinstance(argument, int):
            self.timeout_10ms = argument
        elif request == 0x0703 and isinstance(argument, int):
            self.claim(argument)
        elif request == 0x0707 and isinstance(argument, ctypes.Structure):
            self.transfer(Transfer.from_address(ctypes.addressof(argument)))
        else:
            raise OSError(errno.ENOTTY, os.strerror(errno.ENOTTY))
        return 0

    def claim(self, address: int) -> None:
        if self.unplugged:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        if address in self.held_by_a_driver:
            raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))
        self.claims.append(address)

    def transfer(self, transfer: Transfer) -> None:
        messages = [transfer.msgs[index] for index in range(transfer.nmsgs)]
        if self.failure is not None:
            raise OSError(self.failure, os.strerror(self.failure))
        self.wire.append([(each.addr, self.carry(each)) for each in messages])

    def carry(self, message: Message) -> bytes | int:
        if not message.flags & I2C_M_RD:
            return ctypes.string_at(message.buf, message.len)
        answer = self.answers.pop(0)
        assert len(answer) == message.len
        ctypes.memmove(message.buf, answer, message.len)
        return message.len


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch) -> Kernel:
    kernel = Kernel()
    monkeypatch.setattr(smbus2.smbus2, "ioctl", kernel.ioctl)
    monkeypatch.setattr(linux, "ioctl", kernel.ioctl)
    return kernel


@pytest.fixture
def node(tmp_path: Path) -> str:
    path = tmp_path / "i2c-1"
    path.touch()
    return str(path)


@pytest.fixture
def bus(kernel: Kernel, node: str) -> Iterator[I2cBus]:
    bus = linux.open_i2c("i2c-1", node)
    assert kernel.wire == []
    yield bus
    bus.close()


@pytest.mark.parametrize(
    ("messages", "answers"),
    [
        pytest.param((b"\x75", 2), [b"\x71\x00"], id="a write and a read are one transfer"),
        pytest.param((bytes(range(65)),), [], id="more than 32 bytes go in one transfer"),
        pytest.param(
            (b"\x00", 2, b"\xfd", 3),
            [b"\x01\x02", b"\x00\xff\x00"],
            id="all reads of a transaction come back joined in order",
        ),
    ],
)
def test_a_transaction_is_one_transfer_with_the_address_in_each_message(
    kernel: Kernel, bus: I2cBus, messages: tuple[bytes | int, ...], answers: list[bytes]
) -> None:
    kernel.answers = [*answers]
    assert bus.transaction(0x68, messages) == b"".join(answers)
    assert kernel.wire == [[(0x68, each) for each in messages]]


@pytest.mark.parametrize(("timeout_ms", "tens"), [(100, 10), (101, 11)])
def test_the_adapters_timeout_is_bounded_while_the_bus_is_open(
    kernel: Kernel, node: str, timeout_ms: int, tens: int
) -> None:
    with closing(linux.open_i2c("i2c-1", node, timeout_ms=timeout_ms)):
        assert kernel.timeout_10ms == tens
    assert kernel.timeout_10ms == 100


def test_who_leaves_a_bus_that_another_drives_leaves_its_timeout(kernel: Kernel, node: str) -> None:
    with closing(linux.open_i2c("run", node, timeout_ms=50, alone=True)):
        linux.open_i2c("guard", node, timeout_ms=50).close()
        assert kernel.timeout_10ms == 5
    assert kernel.timeout_10ms == 100


def test_who_is_refused_a_bus_leaves_its_timeout_and_holds_no_descriptor(
    kernel: Kernel, node: str
) -> None:
    with closing(linux.open_i2c("run", node, timeout_ms=50, alone=True)):
        gc.collect()  # what garbage of earlier tests has open
        before = set(Path("/proc/self/fd").iterdir())
        with pytest.raises(BusInUse):
            linux.open_i2c("another", node, timeout_ms=200, alone=True)
        assert kernel.timeout_10ms == 5
        assert set(Path("/proc/self/fd").iterdir()) == before


@pytest.mark.parametrize(
    ("failure", "kind"),
    [
        (EREMOTEIO, NoAcknowledge),
        (errno.ENXIO, NoAcknowledge),
        (errno.EAGAIN, ArbitrationLost),
        (errno.ETIMEDOUT, BusTimeout),
        (errno.EIO, BusFault),
        (errno.EOPNOTSUPP, BusFault),
    ],
)
def test_errno_is_translated_with_bus_and_address(
    kernel: Kernel, bus: I2cBus, failure: int, kind: type[HalError]
) -> None:
    kernel.failure = failure
    with pytest.raises(
        kind, match=r"^i2c-1 address 0x68: .+\(" + errno.errorcode[failure]
    ) as failed:
        bus.write_read(0x68, b"\x75", 1)
    assert isinstance(failed.value, TimeoutError) == (failure == errno.ETIMEDOUT)
    kernel.failure = None
    bus.write(0x68, b"\x75")
    assert kernel.wire == [[(0x68, b"\x75")]]


def test_a_bus_may_be_opened_without_the_module_of_linux(kernel: Kernel, node: str) -> None:
    kernel.answers = [b"\x71"]
    with closing(unopened_lines.open_i2c("i2c-1", node, timeout_ms=20, alone=False)) as bus:
        assert bus.write_read(0x68, b"\x75", 1) == b"\x71"
        assert kernel.timeout_10ms == 2


def test_a_pause_lasts_as_long_as_it_says(bus: I2cBus, monkeypatch: pytest.MonkeyPatch) -> None:
    slept_s: list[float] = []
    monkeypatch.setattr(i2c, "sleep", slept_s.append)
    bus.pause(15 * MILLISECOND)
    bus.pause(2 * SECOND)
    assert slept_s == [0.015, 2.0]


def test_an_address_is_claimed_once_before_its_first_transfer(kernel: Kernel, bus: I2cBus) -> None:
    for address in (0x40, 0x68, 0x40, 0x00):
        bus.write(address, b"\x00")
    assert kernel.claims == [0x40, 0x68, 0x00]


def test_an_address_held_by_a_kernel_driver_and_a_closed_bus_are_left_untouched(
    kernel: Kernel, bus: I2cBus
) -> None:
    kernel.held_by_a_driver = {0x68}
    with pytest.raises(AddressInUse, match="i2c-1 address 0x68: a kernel driver holds"):
        bus.write(0x68, b"\x6b\x80")
    bus.write(0x40, b"\x00")
    bus.close()
    bus.close()
    with pytest.raises(PortClosed, match="i2c-1 address 0x40: "):
        bus.write(0x40, b"\x00")
    assert len(kernel.wire) == 1


def test_a_bus_pulled_out_under_us_is_absent_not_a_fault(kernel: Kernel, bus: I2cBus) -> None:
    bus.write(0x40, b"\x00")
    kernel.unplugged = True
    kernel.failure = errno.ENODEV
    for address in (0x40, 0x41):
        with pytest.raises(BusAbsent, match=f"i2c-1 address 0x{address:02x}"):
            bus.write(address, b"\x00")


@pytest.mark.parametrize(
    ("failure", "advice"),
    [(errno.EACCES, "add the user to the group"), (errno.EBUSY, "cannot be opened")],
)
def test_a_node_that_may_not_be_opened_is_absent_and_says_why(
    monkeypatch: pytest.MonkeyPatch, failure: int, advice: str
) -> None:
    def refuse(path: str, _flags: int) -> int:
        raise OSError(failure, os.strerror(failure), path)

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(BusAbsent, match=advice):
        linux.open_i2c("i2c-1", "/dev/i2c-1")


def test_a_bus_that_is_absent_or_speaks_smbus_alone_is_refused(kernel: Kernel, node: str) -> None:
    kernel.functions = I2C_FUNC_SMBUS_BYTE
    with pytest.raises(BusAbsent, match="plain I2C transfers"):
        linux.open_i2c("i2c-1", node)
    with pytest.raises(BusAbsent, match=r"^front: /dev/i2c-9999 does not exist \(.+i2c-dev"):
        linux.open_i2c("front", 9999)


def test_a_node_that_is_no_bus_is_refused_and_left_closed(node: str) -> None:
    gc.collect()  # what garbage of earlier tests has open is closed now, not while this one looks
    before = set(Path("/proc/self/fd").iterdir())
    with pytest.raises(BusAbsent, match="is not an I2C bus"):
        linux.open_i2c("i2c-1", node)
    assert set(Path("/proc/self/fd").iterdir()) == before


def test_a_port_that_may_be_opened_is_left_as_it_was() -> None:
    ours, theirs = os.openpty()
    os.write(ours, b"waiting\n")
    check_node("treads", os.ttyname(theirs))
    assert os.read(theirs, 100) == b"waiting\n"
    for each in (ours, theirs):
        os.close(each)


def test_a_node_that_is_not_there_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(BusAbsent, match=r"^i2c1: .*/i2c-1 cannot be opened \(No such file"):
        check_node("i2c1", str(tmp_path / "i2c-1"))
    with pytest.raises(BusAbsent, match="cannot be opened"):
        check_node("i2c1", str(tmp_path))  # which can be read, and not written


@pytest.mark.parametrize("number", sorted(errno.errorcode))
def test_what_an_adapter_reported_is_found_again(number: int) -> None:
    error = from_os_error(OSError(number, os.strerror(number)), "i2c1 0x68")
    assert errno_of(type(error).__name__, str(error)) == number


@pytest.mark.parametrize(("period", "duration"), [((), 0), ((MILLISECOND,), 20 * MILLISECOND)])
def test_a_reading_is_dead_for_as_many_periods_as_it_showed_it(
    period: tuple[int, ...], duration: int
) -> None:
    fault = Fault.of(Stuck("imu", "acceleration upwards", 7, 20), 1, *period)
    assert (fault.kind, fault.value, fault.duration) == ("Stuck", 7, duration)


def test_a_system_that_does_not_know_linuxs_number_of_a_refusal_has_it_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delattr(errno, "EREMOTEIO")
    elsewhere = ModuleType("elsewhere")
    SourceFileLoader("elsewhere", wire_errors.__file__).exec_module(elsewhere)
    assert elsewhere.EREMOTEIO == EREMOTEIO


def test_an_error_without_a_number_is_a_fault_that_says_so() -> None:
    error = from_os_error(OSError("gone"), "i2c1 0x68")
    assert type(error) is BusFault
    assert str(error).endswith("(no errno)")


@pytest.mark.parametrize(
    ("kind", "number"),
    [
        ("NoAcknowledge", EREMOTEIO),
        ("BusTimeout", errno.ETIMEDOUT),
        ("BusFault", errno.EIO),
        ("LettersLost", errno.EIO),
    ],
)
def test_without_an_errno_the_class_says_it(kind: str, number: int) -> None:
    assert errno_of(kind, "sonar: unplugged (pulled out)") == number
