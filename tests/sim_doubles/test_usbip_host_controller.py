"""The kernel's virtual USB host controller, by the files it has in sysfs; here in a folder."""

from pathlib import Path
from socket import socketpair

import pytest

from firmware_runtime.cli.main import main
from sim_doubles.usbip.host_controller import HostController
from sim_doubles.usbip.packets import NotAttached

HEAD = "hub port sta spd dev      sockfd local_busid\n"
TAKEN = "hs  0000 006 002 00010002 000003 1-1\n"
FREE = "hs  0001 004 000 00000000 000000 0-0\n"
FREE_SUPER_SPEED = "ss  0008 004 000 00000000 000000 0-0\n"


def controller(folder: Path, *ports: str) -> HostController:
    (folder / "status").write_text(HEAD + "".join(ports))
    (folder / "attach").touch()
    (folder / "detach").touch()
    return HostController(folder)


def test_a_device_is_attached_to_the_first_free_port(tmp_path: Path) -> None:
    ours, theirs = socketpair()
    with ours, theirs:
        port = controller(tmp_path, TAKEN, FREE, FREE_SUPER_SPEED).attach(theirs, 7)
        assert (tmp_path / "attach").read_text() == f"1 {theirs.fileno()} 7 2"
    assert port == 1


def test_a_device_is_detached_by_its_port(tmp_path: Path) -> None:
    controller(tmp_path, TAKEN).detach(0)
    assert (tmp_path / "detach").read_text() == "0"


def test_no_free_port_is_said_in_a_sentence(tmp_path: Path) -> None:
    ours, theirs = socketpair()
    with ours, theirs, pytest.raises(NotAttached, match="no port is free"):
        controller(tmp_path, TAKEN, FREE_SUPER_SPEED).attach(theirs, 1)


def test_a_kernel_without_the_controller_is_said_in_a_sentence(tmp_path: Path) -> None:
    ours, theirs = socketpair()
    with ours, theirs, pytest.raises(NotAttached, match="expected root and the module vhci-hcd"):
        HostController(tmp_path).attach(theirs, 1)
    HostController(tmp_path).detach(1)


def test_the_device_node_is_that_of_the_port(tmp_path: Path) -> None:
    hub = tmp_path / "usb1"
    for port, bus in (("1-1", "i2c-3"), ("1-2", "i2c-9")):
        (hub / port / f"{port}:1.0" / bus / "i2c-dev" / bus).mkdir(parents=True)
    found = controller(tmp_path)
    assert found.i2c_device(0) == Path("/dev/i2c-3")
    assert found.i2c_device(1) == Path("/dev/i2c-9")
    assert found.i2c_device(2) is None


def test_serial_ports_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    treads = ("driver=sabertooth", "port=treads", "address=128", "refresh_s=0.2", "timeout_s=1.0")
    words = [f"treads.{each}" for each in treads]
    words += ["ports.treads.device=/dev/no/treads", "ports.treads.baud=9600"]
    options = [option for word in words for option in ("--set", word)]
    assert main(["doubles", "serve", "--usbip", "detective", *options]) == 2
    assert "ports.treads: a serial port, expected I2C buses only" in capsys.readouterr().err
