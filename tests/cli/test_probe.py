"""`probe`: what is on the buses, and which board it fits; chips that a page names."""

import errno
import json
import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from firmware_drivers.catalogue import table
from firmware_drivers.catalogue.table import identities
from firmware_drivers.commands import probe, probing

from firmware_runtime.board import registry
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.scan import ADDRESSES
from firmware_runtime.hal.wire_errors import AddressInUse, BusAbsent, BusInUse
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import AdapterError, FaultScript
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.inertial_truth import InertialTruth
from tests.support.command import Command
from tests.support.fake_machines import lay_out, link
from tests.support.second_choice_board import second_choice_board

REST = InertialTruth((0.0, 0.0, 9.8), (0.0, 0.0, 0.0), (2e-5, 0.0, -4e-5), 25.0)


def now() -> int:
    return 0


def tachobots_bus() -> I2cBusDouble:
    chips = [Pca9685Double(now, 0x40), Mpu9250Double(now, lambda _: REST, noise_seed=None)]
    return I2cBusDouble("i2c", now, chips)


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, I2cBus | Exception]:
    """Buses by device node, or what opening them raises; the files of the machine follow."""
    buses: dict[str, I2cBus | Exception] = {}
    names = {"0": "SMBus I801 adapter at 0700", "1": "bcm2835 (i2c@7e804000)", "7": "i2c-gpio7"}
    files = lay_out(
        tmp_path, {f"/sys/bus/i2c/devices/i2c-{n}/name": f"{name}\n" for n, name in names.items()}
    )
    lay_out(tmp_path, {f"/dev/i2c-{n}": "" for n in names})

    def open_i2c(_name: str, device: str, *, alone: bool) -> I2cBus:
        assert alone
        opened = buses[device]
        if isinstance(opened, Exception):
            raise opened
        return opened

    monkeypatch.setattr(probe, "THIS_MACHINE", files)
    monkeypatch.setattr(probing, "open_i2c", open_i2c)
    monkeypatch.setattr(probing, "holders", lambda _files, _nodes: ([], 0))
    return buses


def test_doubles_show_what_a_robot_would(command: Command) -> None:
    ended = command("probe", "--doubles", "tachobot")
    assert ended.status == 0
    assert "0x40  could be PCA9685 (no identity register)" in ended.out
    assert "0x68  MPU-9250: WHO_AM_I reads 71" in ended.out
    assert (
        "tachobot fits /dev/i2c-1: imu MPU-9250 0x68, thrust_pairs PCA9685 0x40; not certain (no "
        "identity register): thrust_pairs\n"
    ) in ended.out
    assert "detective does not fit: 5 of 6 chips missing: treads MD25 0x58" in ended.out


def test_the_json_says_the_same(command: Command) -> None:
    document = json.loads(command("probe", "--doubles", "detective", "--json").out)
    (bus,) = document["buses"]
    found = {each["address"]: (each["chips"], each["certain"]) for each in bus["found"]}
    assert found[0x58] == (["MD25"], False)
    assert found[0x70] == ([], False)
    fitted = document["boards"]["detective"]
    assert fitted["fits"] is True
    assert fitted["uncertain"] == [each["key"] for each in fitted["present"]]
    assert document["boards"]["tachobot"]["missing"] == [
        {"key": "imu", "chip": "MPU-9250", "bus": "i2c1", "address": 0x68}
    ]


def test_a_board_of_ones_own_is_compared_by_its_file(command: Command, tmp_path: Path) -> None:
    own = second_choice_board(tmp_path)
    assert "detective fits /dev/i2c-1" in command("probe", "--doubles", own).out
    ended = command("probe", "--doubles", own, "--board", "tachobot")
    assert "tachobot does not fit" in ended.out
    assert "detective" not in ended.out.partition("\n\n")[2]
    assert command("probe", "--doubles", own, "--board", tmp_path / "none.toml").status == 2


def test_a_chip_that_nothing_here_recognises_is_called_so(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = tuple(each for each in identities() if each.chip != "MPU-9250")
    for module in (probe, table):
        monkeypatch.setattr(module, "identities", lambda: known)
    ended = command("probe", "--doubles", "tachobot")
    assert "tachobot does not fit: 1 of 2 chips missing: imu MPU-9250 0x68; nothing" in ended.out
    assert "nothing here recognises MPU-9250, expected an entry point" in ended.out


def test_a_chip_by_another_name_than_its_driver_says_is_called_so(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = tuple(
        each._replace(chip="Mpu-9250") if each.chip == "MPU-9250" else each for each in identities()
    )
    for module in (probe, table):
        monkeypatch.setattr(module, "identities", lambda: known)
    ended = command("probe", "--doubles", "tachobot")
    assert "nothing here recognises MPU-9250, expected an entry point" in ended.out
    assert "that does; did you mean Mpu-9250?" in ended.out


def test_a_board_on_another_bus_comes_with_what_to_set(
    command: Command, machine: dict[str, I2cBus | Exception]
) -> None:
    machine |= {"/dev/i2c-1": I2cBusDouble("i2c", now, []), "/dev/i2c-7": tachobots_bus()}
    ended = command("probe")
    assert ended.status == 0
    assert "left alone: it is the SMBus of the mainboard; `firmware-runtime probe" in ended.out
    assert "nothing answers" in ended.out
    assert "tachobot fits /dev/i2c-7" in ended.out
    assert "with --set buses.i2c1.device=/dev/i2c-7" in ended.out


def test_a_bus_left_alone_is_asked_when_it_is_named(
    command: Command, machine: dict[str, I2cBus | Exception]
) -> None:
    machine["/dev/i2c-0"] = tachobots_bus()
    assert "0x68  MPU-9250" in command("probe", "0").out
    machine["/dev/i2c-0"] = tachobots_bus()
    assert "0x68  MPU-9250" in command("probe", "/dev/i2c-0").out


def test_a_bus_that_was_asked_is_given_back(
    command: Command, machine: dict[str, I2cBus | Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    machine["/dev/i2c-1"] = bus = tachobots_bus()
    given_back: list[str] = []
    monkeypatch.setattr(bus, "close", lambda: given_back.append("/dev/i2c-1"))
    command.said("probe", "1")
    assert given_back == ["/dev/i2c-1"]


def test_a_bus_that_a_run_drives_is_left_alone(
    command: Command, machine: dict[str, I2cBus | Exception]
) -> None:
    machine |= {"/dev/i2c-1": BusInUse("driven"), "/dev/i2c-7": tachobots_bus()}
    ended = command("probe")
    assert ended.status == 0
    assert (
        "/dev/i2c-1 (bcm2835 (i2c@7e804000))\n  left alone: a run drives it (another process)"
        in ended.out
    )
    assert command("probe", "1").status == 3


def test_a_bus_that_may_not_be_opened_says_so(
    command: Command, machine: dict[str, I2cBus | Exception]
) -> None:
    refused = BusAbsent("/dev/i2c-1: may not be opened by this user; add the user")
    machine |= {"/dev/i2c-1": refused, "/dev/i2c-7": BusAbsent("/dev/i2c-7: gone")}
    ended = command("probe")
    assert ended.status == 3
    assert "may not be opened by this user" in ended.out
    assert "does not fit" not in ended.out


def test_a_held_address_is_named_with_its_driver(
    command: Command,
    machine: dict[str, I2cBus | Exception],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bus = tachobots_bus()
    transaction = bus.transaction

    def refuses(address: int, messages: Sequence[Message]) -> bytes:
        if address == 0x68:
            raise AddressInUse("held")
        return transaction(address, messages)

    monkeypatch.setattr(bus, "transaction", refuses)
    driver = tmp_path / "sys/bus/i2c/drivers/inv-mpu6050-i2c"
    driver.mkdir(parents=True)
    link(tmp_path, "/sys/bus/i2c/devices/1-0068/driver", driver)
    machine["/dev/i2c-1"] = bus
    ended = command("probe", "1")
    assert "0x68  held by the kernel's driver inv-mpu6050-i2c" in ended.out
    assert "tachobot does not fit" in ended.out


@pytest.mark.parametrize(
    ("number", "error", "said"),
    [
        (1, errno.EREMOTEIO, "0x68  acknowledged once, then: i2c 0x68: not acknowledged"),
        (2, errno.ETIMEDOUT, "0x68  acknowledges its address, then: i2c 0x68: timed out"),
        (2, errno.EIO, "0x68  acknowledges its address, then: i2c 0x68: the adapter"),
    ],
)
def test_a_chip_that_cannot_be_read_is_said_to_be_that_and_fits_nothing(
    command: Command, machine: dict[str, I2cBus | Exception], number: int, error: int, said: str
) -> None:
    inertial = Mpu9250Double(now, lambda _: REST, noise_seed=None)
    machine["/dev/i2c-1"] = bus = I2cBusDouble("i2c", now, [inertial])
    first = 0x68 - ADDRESSES.start + number  # those before it are asked once: nothing is there
    bus.faults = FaultScript([AdapterError(first=first, errno=error)])
    ended = command("probe", "1")
    assert said in ended.out
    assert "tachobot does not fit" in ended.out


def test_a_bus_that_times_out_is_not_asked_to_the_end(
    command: Command, machine: dict[str, I2cBus | Exception]
) -> None:
    machine["/dev/i2c-1"] = bus = tachobots_bus()
    bus.faults = FaultScript([AdapterError(address=0x21, times=2, errno=errno.ETIMEDOUT)])
    ended = command("probe", "1")
    assert ended.status == 3
    assert "not asked to the end: i2c 0x21: timed out" in ended.out
    assert "0x68" not in ended.out


def test_on_a_machine_without_a_bus_the_sentence_says_how_to_get_one(
    command: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(probe, "THIS_MACHINE", lay_out(tmp_path, {}))
    ended = command("probe")
    assert ended.status == 3
    assert "dtparam=i2c_arm=on" in ended.out


ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "raspberry-pi.md").read_text(encoding="utf-8")
NEW_ADDRESS = re.compile(r"0xA0 0xAA 0xA5 (0x..);.* (0x..) 0 .*: (0x..)$", re.MULTILINE)


def test_new_addresses_of_the_page_are_those_of_the_board() -> None:
    devices = registry.load("detective").devices
    wanted = {device.address for device in devices if device.chip in {"SRF08", "CMPS12"}}
    given = NEW_ADDRESS.findall(PAGE)
    assert {int(address, 0) for _, _, address in given} == wanted
    assert all(int(byte, 0) == 2 * int(address, 0) for byte, _, address in given)


@pytest.mark.parametrize("board", ["detective", "tachobot"])
def test_the_page_names_every_chip_with_its_address(board: str) -> None:
    for device in registry.load(board).devices:
        assert device.chip in PAGE
        assert f"0x{device.address:02x}" in PAGE
