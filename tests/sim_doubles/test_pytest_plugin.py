"""The fixtures of `sim_doubles.pytest_plugin`, used as any package's tests use them."""

import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep
from types import ModuleType
from typing import Any

import pytest
import serial
import smbus2
from smbus2 import SMBus

import sim_doubles.busio
from firmware_runtime.errors import ConfigError
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.serial_pty import SerialPty
from sim_doubles.smbus import SMBus as OurSMBus
from sim_doubles.testing.substitution import open_doubles, substitute
from sim_doubles.testing.virtual_time import VirtualTime
from sim_doubles.testing.wire_log import WireLog, explained

Connect = Callable[..., Any]


def test_a_bus_imported_by_name_or_of_a_class_derived_opens_the_tests_bus(
    i2c_double: Connect,
) -> None:
    class Bus(smbus2.SMBus):
        pass

    chip = i2c_double("pca9685", address=0x41)
    with SMBus(1) as bus:
        bus.write_byte_data(0x41, 0x00, 0x20)
        bus.write_i2c_block_data(0x41, 0x06, [0, 0, 0, 4])
    assert chip.duty(0) == 0.25
    assert Bus("/dev/i2c-1").read_byte_data(0x41, 0xFE) == 0x1E


def test_smbus_busio_and_board_can_be_imported(i2c_double: Connect) -> None:
    import board
    import busio
    import digitalio
    import smbus
    from micropython import const

    i2c_double("pca9685")
    assert smbus.SMBus is OurSMBus
    for i2c in (busio.I2C(board.SCL, board.SDA), board.I2C()):
        assert i2c.try_lock()
        assert i2c.scan() == [0x40, 0x70]
    assert (board.D4, const(7)) == ("D4", 7)
    line = digitalio.DigitalInOut(board.D4)
    line.switch_to_output(value=True)
    assert digitalio.DigitalInOut("D4").value


@pytest.mark.slow
def test_a_session_leaves_nothing_in_the_way_of_imports_after_it(tmp_path: Path) -> None:
    before = sys.meta_path.copy()
    ended = pytest.main(["-q", "-p", "no:cacheprovider", f"--rootdir={tmp_path}", f"{tmp_path}"])
    assert ended == pytest.ExitCode.NO_TESTS_COLLECTED
    assert sys.meta_path == before


def test_outside_a_test_smbus2_is_what_it_was() -> None:
    assert smbus2.SMBus.open is not OurSMBus.open
    with pytest.raises(OSError, match="i2c-987"):
        SMBus("/dev/i2c-987")


def test_a_sensor_senses_what_the_test_says(virtual_time: VirtualTime, i2c_double: Connect) -> None:
    wall = [0.5]
    i2c_double("srf08", address=0x71, echoes=lambda _at: wall)
    i2c_double("hmc5883l")
    with SMBus(1) as bus:
        for wall[0], centimetres in ((0.5, 50), (0.75, 75)):
            bus.write_byte_data(0x71, 0, 0x51)
            virtual_time.sleep(0.07)
            assert bus.read_i2c_block_data(0x71, 2, 2) == [0, centimetres]
        assert bus.read_i2c_block_data(0x1E, 0x0A, 3) == list(b"H43")
        bus.write_byte_data(0x1E, 2, 0)  # it measures at 15 Hz
        virtual_time.sleep(0.2)
        field = struct.unpack(">3h", bytes(bus.read_i2c_block_data(0x1E, 3, 6)))
        assert field == pytest.approx((218, -436, 0), abs=30), "x, z, y: to the north and down"
        begun_s = virtual_time.now_s
        i2c_double("mpu9250", noise_seed=None)  # which has had power for a while: 1 g, at once
        assert bus.read_i2c_block_data(0x68, 0x3F, 2) == [0x40, 0x00]
    assert virtual_time.now_s - begun_s < 0.001


def test_a_double_of_ones_own_is_wired_as_class_or_as_object(i2c_double: Connect) -> None:
    first = i2c_double(Pca9685Double, address=0x42)
    second = i2c_double(Pca9685Double(lambda: 0, 0x43))
    with SMBus(1) as bus:
        bus.write_byte_data(0x42, 0x00, 0x20)
        bus.write_byte_data(0x43, 0x00, 0x20)
    assert first.running
    assert second.running


def test_a_robot_with_two_buses(i2c_double: Connect) -> None:
    i2c_double("pca9685", bus=1)
    i2c_double("pca9685", address=0x50, bus=3)
    assert SMBus(3).read_byte_data(0x50, 0) == 0x11
    with pytest.raises(OSError, match=" "):
        SMBus(3).read_byte_data(0x40, 0)
    with pytest.raises(FileNotFoundError):
        SMBus(2)


@pytest.mark.parametrize(
    "wrong",
    [
        {"chip": "pca9686"},
        {"chip": "mpu9250", "acceleration": (0, 0, 1)},
        {"chip": "pca9685", "address": 0x70},
        {"chip": "maxbotix"},
        {"chip": "pca9685", "colour": "red"},
    ],
)
def test_what_cannot_be_wired_is_refused_in_a_sentence(
    i2c_double: Connect, wrong: dict[str, Any]
) -> None:
    with pytest.raises(ConfigError) as refused:
        i2c_double(**wrong)
    assert len(refused.value.faults) == 1


def test_virtual_time_passes_by_sleeping_and_on_the_wire(
    virtual_time: VirtualTime, i2c_double: Connect
) -> None:
    i2c_double("pca9685")
    before = monotonic()
    sleep(1.5)
    time.sleep(0.5)
    assert monotonic() - before == pytest.approx(2.0, abs=1e-5)
    at = virtual_time()
    SMBus(1).read_byte_data(0x40, 0)
    assert virtual_time() - at == 97_500  # 39 bits at 400 kHz
    until = time.monotonic() + 0.001
    while time.monotonic() < until:  # a loop that waits by polling the clock ends
        pass
    with pytest.raises(ValueError, match="negative"):
        time.sleep(-1)
    virtual_time.sleep(5)
    at_s = virtual_time() / 1e9
    assert 7.001 < virtual_time.now_s < 7.003
    clocks = [time.monotonic(), time.perf_counter(), time.monotonic_ns() / 1e9]
    assert [*clocks, time.perf_counter_ns() / 1e9] == pytest.approx([at_s] * 4, abs=1e-4)
    assert time.time() == pytest.approx(time.time_ns() / 1e9, abs=1e-4)


def test_a_name_imported_by_a_driver_is_found_wherever_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with monkeypatch.context() as patch:
        substitute(patch, {serial.Serial: SerialPty})
        assert vars(serial)["Serial"] is SerialPty
    assert vars(serial)["Serial"] is not SerialPty


@pytest.mark.parametrize(
    ("name", "of", "ours"), [("smbus", "SMBus", OurSMBus), ("busio", "I2C", sim_doubles.busio.I2C)]
)
def test_a_compiled_bus_gives_way_wherever_it_was_imported_by_name(
    monkeypatch: pytest.MonkeyPatch, name: str, of: str, ours: type
) -> None:
    theirs = type(of, (), {})
    compiled, driver = ModuleType(name), ModuleType("somebodys_driver")
    vars(compiled)[of] = vars(driver)["Bus"] = theirs
    for module in (compiled, driver):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    with monkeypatch.context() as patch:
        open_doubles(patch)
        assert vars(compiled)[of] is vars(driver)["Bus"] is ours
    assert vars(compiled)[of] is vars(driver)["Bus"] is theirs


def test_faults_strike_and_are_counted(i2c_double: Connect, i2c_faults: FaultScript) -> None:
    i2c_double("pca9685")
    i2c_faults.add(NackAddress(first=1, times=2))
    bus = SMBus(1)
    assert bus.read_byte_data(0x40, 0) == 0x11
    for _ in range(2):
        with pytest.raises(OSError, match=" "):
            bus.read_byte_data(0x40, 0)
    assert bus.read_byte_data(0x40, 0) == 0x11
    assert i2c_faults.count() == 2


def test_chips_break_by_kind_for_their_time(
    i2c_double: Connect, i2c_strike: Callable[..., None], virtual_time: VirtualTime
) -> None:
    i2c_double("pca9685")
    i2c_double("mpu9250")
    bus = SMBus(1)
    i2c_strike("zero", "0x40", for_s=1.0)
    assert (bus.read_byte_data(0x40, 0), bus.read_byte_data(0x68, 0x75)) == (0x00, 0x71)
    virtual_time.sleep(1.1)
    assert bus.read_byte_data(0x40, 0) == 0x11
    i2c_strike("absent", "i2c-1@0x40")
    with pytest.raises(OSError, match=" "):
        bus.read_byte_data(0x40, 0)
    with pytest.raises(ConfigError, match="0x41"):
        i2c_strike("absent", "0x41")
    with pytest.raises(ConfigError, match="not on these doubles"):
        i2c_strike("push")


def test_the_log_is_compared_line_by_line(i2c_double: Connect, i2c_log: WireLog) -> None:
    i2c_double("pca9685")
    bus = SMBus(1)
    bus.read_byte_data(0x40, 0)
    assert i2c_log == ["0x40 W 00, R 11"]
    i2c_log.clear()
    bus.write_byte(0x40, 0)
    bus.read_byte(0x40)
    assert i2c_log[1:] == ["0x40 R 11"]
    assert explained(i2c_log, ["0x40 W 00", "0x40 R 10"]) is not None
    shown = explained(["0x40 W 00"], i2c_log) or []
    assert shown[2:] == [" 0x40 W 00", "+0x40 R 11"]
    assert explained([], []) is None


def test_a_protocol_warning_fails_the_test_that_wants_none(
    i2c_double: Connect, no_protocol_warning: Callable[[], None], i2c_bus: I2cBusDouble
) -> None:
    chip = i2c_double("pca9685")
    no_protocol_warning()
    SMBus(1).write_byte_data(0x40, 0x00, 0x50)  # EXTCLK, with nothing at the pin
    with pytest.raises(pytest.fail.Exception, match="PCA9685"):
        no_protocol_warning()
    chip.warnings.clear()
    assert i2c_bus.transactions == 1


@pytest.mark.slow
def test_a_robot_runs_on_its_doubles_in_virtual_time(board: Connect) -> None:
    robot = board("tachobot", set={"world.mass_kg": 2.5})
    assert robot.outputs == {"thrust_pairs": 0}
    assert robot.run(4.0).at_s == 4.0
    assert robot.outputs == {"thrust_pairs": 8}
    assert robot.board.settings.world.mass_kg == 2.5


def test_a_serial_device_sends_and_receives(
    serial_double: Callable[..., SerialPty], virtual_time: VirtualTime
) -> None:
    device = serial_double("maxbotix", distance=1.5)
    with serial.Serial(device.path, 9600, timeout=10) as port:
        port.reset_input_buffer()
        virtual_time.sleep(0.5)
        lines = iter(lambda: port.read_until(b"\r"), b"")
        assert next(line for line in lines if line[1:4].isdigit()) == b"R150\r"
        device.disconnect()
    device.settle()  # with nothing at the other end there is nothing to wait for
    with pytest.raises(ConfigError, match="serial"):
        serial_double("pca9685")


@pytest.mark.slow
def test_the_plugin_imports_nothing_of_the_doubles() -> None:
    code = (
        "import sys, sim_doubles.pytest_plugin;"
        "print(sorted(m for m in sys.modules if m.split('.')[0] in {'numpy',"
        "'smbus2','msgspec'}), 'firmware_runtime.hal.i2c' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["[]", "False"]
