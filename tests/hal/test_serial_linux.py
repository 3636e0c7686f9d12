"""The real pyserial on a real pseudo-terminal; the test holds its other end."""

import errno
import gc
import itertools
import os
import re
import select
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from pathlib import Path
from threading import Thread

import pytest

from firmware_runtime.hal import linux_serial, unopened_lines
from firmware_runtime.hal.linux_serial import LinuxSerialPort, open_serial
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import BusAbsent, BusFault, BusTimeout, PortClosed


class Line:
    """A pseudo-terminal: `far` is the device's end, `path` the node a program opens."""

    def __init__(self) -> None:
        self.far, self.near = os.openpty()
        self.path = os.ttyname(self.near)
        self.is_cut = False

    def cut(self) -> None:
        """Pull the plug."""
        os.close(self.far)
        self.is_cut = True

    def close(self) -> None:
        if not self.is_cut:
            self.cut()
        os.close(self.near)


@pytest.fixture
def line() -> Iterator[Line]:
    line = Line()
    yield line
    line.close()


@pytest.fixture
def port(line: Line) -> Iterator[LinuxSerialPort]:
    port = open_serial("sonar", line.path)
    yield port
    port.close()


def test_bytes_arrive_unchanged_in_both_directions_in_as_many_parts_as_they_came(
    line: Line, port: LinuxSerialPort
) -> None:
    every_byte = bytes(range(256))
    port.write(every_byte)
    assert os.read(line.far, 1000) == every_byte
    for part in (every_byte, b"R12", b"3\r"):
        os.write(line.far, part)
        assert port.read_available() == part
    assert port.read_available() == b""


def test_a_port_that_belongs_to_no_run_is_never_ahead_of_it(port: LinuxSerialPort) -> None:
    port.write(bytes(100))
    assert port.elapsed() == 0


def test_reading_waits_for_nothing(port: LinuxSerialPort, monkeypatch: pytest.MonkeyPatch) -> None:
    waited: list[float | None] = []

    def noted(*sockets: Iterable[int], wait: Callable[..., object] = select.select) -> object:
        waited.append(sockets[3])  # type: ignore[arg-type]
        return wait(*sockets[:3], 0.0)

    monkeypatch.setattr(select, "select", noted)
    assert port.read_available() == b""
    assert set(waited) <= {0.0}


def test_a_port_may_be_opened_without_the_module_of_linux(line: Line) -> None:
    with closing(unopened_lines.open_serial("sonar", line.path, 9600, alone=True)) as port:
        os.write(line.far, b"R123\r")
        assert port.read_available() == b"R123\r"


def test_what_came_before_the_port_was_opened_or_is_discarded_is_gone(line: Line) -> None:
    open_serial("sonar", line.path).close()  # leaves the line raw, as the next program finds it
    os.write(line.far, b"old")
    port = open_serial("sonar", line.path)
    for discarded in (b"", b"old" * 1000):
        os.write(line.far, discarded)
        if discarded:
            port.discard_input()
        os.write(line.far, b"new")
        assert port.read_available() == b"new"
    port.close()


def test_a_port_that_is_open_is_not_opened_again(line: Line, port: LinuxSerialPort) -> None:
    with pytest.raises(BusAbsent, match=rf"^other: {line.path} is in use by another program"):
        open_serial("other", line.path)
    port.close()
    open_serial("other", line.path).close()


USES: dict[str, Callable[[LinuxSerialPort], object]] = {
    "read": LinuxSerialPort.read_available,
    "write": lambda port: port.write(b"\xaa"),
    "flush": LinuxSerialPort.discard_input,
}


def test_a_port_that_takes_nothing_is_unplugged_or_closed_says_so(
    line: Line, port: LinuxSerialPort
) -> None:
    more_than_the_kernel_holds = bytes(1_000_000)  # the far end does not read
    with pytest.raises(BusTimeout, match="write timed out, expected 1000000 bytes to be taken"):
        port.write(more_than_the_kernel_holds)
    with pytest.raises(BusTimeout, match="expected 1 bytes to be taken"):
        port.write(b"x")  # there is no room at all
    line.cut()
    for use, call in USES.items():
        with pytest.raises(BusFault, match=rf"^sonar: {line.path} {use} failed, .*unplugged"):
            call(port)
    port.close()
    port.close()
    for use, call in USES.items():
        with pytest.raises(PortClosed, match=f"{use} after it was closed"):
            call(port)
    expected = r"^sonar: /dev/ttyNONE does not exist \(this machine has .+\); name"
    with pytest.raises(BusAbsent, match=expected):
        open_serial("sonar", "/dev/ttyNONE")


def test_what_the_kernel_does_not_take_at_once_is_written_as_the_far_end_reads(line: Line) -> None:
    sent, arrived = bytes(range(256)) * 400, bytearray()

    def read() -> None:
        while len(arrived) < len(sent):
            arrived.extend(os.read(line.far, 65536))

    reader = Thread(target=read)
    with closing(open_serial("sonar", line.path, write_timeout_ms=60_000)) as port:
        reader.start()
        port.write(sent)
        reader.join()
    assert arrived == sent


def test_bytes_that_were_taken_are_no_time_out_however_late_it_is(
    line: Line, port: LinuxSerialPort, monkeypatch: pytest.MonkeyPatch
) -> None:
    hours = itertools.count(step=3600.0)
    monkeypatch.setattr(linux_serial, "monotonic", lambda: next(hours))
    port.write(b"all")
    assert os.read(line.far, 3) == b"all"


def test_a_file_that_is_no_port_is_refused_and_left_closed(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    gc.collect()  # what garbage of earlier tests has open is closed now, not while this one looks
    before = set(Path("/proc/self/fd").iterdir())
    with pytest.raises(BusAbsent, match="cannot be opened as a serial port"):
        open_serial("sonar", str(tmp_path / "file"))
    assert set(Path("/proc/self/fd").iterdir()) == before


@pytest.mark.parametrize("baud", [-9600, 10**10])
def test_a_rate_that_cannot_be_is_refused(line: Line, baud: int) -> None:
    with pytest.raises(BusAbsent, match=re.escape(f"cannot be set to {baud} baud")):
        open_serial("sonar", line.path, baud)


def test_a_port_that_may_not_be_opened_names_its_fix(
    line: Line, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: str, _flags: int) -> int:
        raise OSError(errno.EACCES, os.strerror(errno.EACCES), path)

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(BusAbsent, match=r"add the user to the group of the device \(dialout\)"):
        open_serial("sonar", line.path)


class Adapter:
    """A USB adapter under an alias of udev's, which leads to another node each time."""

    def __init__(self, alias: Path) -> None:
        self.alias = alias
        self.line: Line | None = None

    def plug_in(self) -> Line:
        line = self.line = Line()
        self.alias.unlink(missing_ok=True)
        self.alias.symlink_to(line.path)
        return line

    def unplug(self) -> None:
        assert self.line is not None
        self.line.close()
        self.alias.unlink()


def test_an_adapter_that_comes_back_under_its_alias_is_opened_again(tmp_path: Path) -> None:
    adapter = Adapter(tmp_path / "ttySonar")
    first = adapter.plug_in()
    port = open_serial("sonar", str(adapter.alias))
    os.write(first.far, b"R123\r")
    assert port.read_available() == b"R123\r"
    adapter.unplug()
    with pytest.raises(BusFault, match="unplugged"):
        port.read_available()
    for _ in range(2):
        with pytest.raises(BusFault, match="unplugged"):
            port.discard_input()
    second = adapter.plug_in()
    port.discard_input()
    os.write(second.far, b"R124\r")
    assert port.read_available() == b"R124\r"
    port.write(b"!")
    assert os.read(second.far, 10) == b"!"
    port.close()
    with pytest.raises(PortClosed):
        port.write(b"!")
    second.close()


class ScriptedPort(SerialPort):
    name = "sonar"

    def __init__(self, *arrivals: bytes) -> None:
        self.arrivals = list(arrivals)

    def write(self, data: bytes) -> None:
        raise AssertionError(data)

    def read_available(self) -> bytes:
        return self.arrivals.pop(0) if self.arrivals else b""

    def close(self) -> None:
        self.arrivals.clear()


@pytest.mark.parametrize(
    ("arrivals", "left"),
    [
        ((), b""),
        ((b"R123\r",), b""),
        ((b"R12", b"3\r", b"R"), b""),
        ((b"old", b"", b"new"), b"new"),
    ],
)
def test_discarding_takes_what_arrived_in_however_many_parts_and_leaves_what_comes_later(
    arrivals: tuple[bytes, ...], left: bytes
) -> None:
    port = ScriptedPort(*arrivals)
    port.discard_input()
    assert port.read_available() == left
