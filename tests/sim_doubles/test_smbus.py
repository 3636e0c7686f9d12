"""smbus2 and CircuitPython's busio on doubles: what calls put on the wire, answers and errors."""

import errno
from array import array
from collections.abc import Callable, Iterator

import pytest

from firmware_runtime.hal.wire_errors import EREMOTEIO
from sim_doubles.busio import I2C
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.register_target import RegisterTarget
from sim_doubles.clock import ManualClock
from sim_doubles.faults import AdapterError, FaultScript, NackAddress, StuckSda
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.plugged import plug
from sim_doubles.smbus import SMBus, i2c_msg, packet_error_code

ADDRESS = 0x50


class Memory(RegisterTarget):
    """256 bytes, from the start 0, 1, 2 and so on."""

    def __init__(self) -> None:
        super().__init__(ManualClock(), ADDRESS)
        self.content = bytearray(range(256))

    def _read_register(self, register: int) -> int:
        return self.content[register]

    def _write_register(self, register: int, byte: int) -> None:
        self.content[register] = byte


def memory_bus(adapter: str = "bcm2835") -> I2cBusDouble:
    return I2cBusDouble("i2c-1", ManualClock(), [Memory()], adapter=adapter)


@pytest.fixture
def bus() -> Iterator[I2cBusDouble]:
    with plug(1, memory_bus()) as bus:
        yield bus


NONE: list[str] = []
ALL_32 = "".join(f" {number:02x}" for number in range(32))
"""None of the bytes got to the wire; the first 32 of the memory."""


@pytest.mark.parametrize(
    ("call", "arguments", "expected", "wire"),
    [
        ("write_quick", [], None, ["W"]),
        ("read_byte", [], 0, ["R 00"]),
        ("write_byte", [0x21], None, ["W 21"]),
        pytest.param("write_byte", [0x121], None, ["W 21"], id="a byte too large"),
        pytest.param("write_byte_data", [3, -1], None, ["W 03 ff"], id="a negative byte"),
        pytest.param("write_byte_data", [3, 1.5], TypeError, NONE, id="a byte that is none"),
        ("read_byte_data", [0x42], 0x42, ["W 42, R 42"]),
        ("write_byte_data", [0x42, 7, False], None, ["W 42 07"]),
        ("read_word_data", [0x42], 0x4342, ["W 42, R 42 43"]),
        ("write_word_data", [0x42, 0x1234], None, ["W 42 34 12"]),
        ("process_call", [0x42, 0x1234], 0x4544, ["W 42 34 12, R 44 45"]),
        ("write_block_data", [0x42, [1, 2, 3]], None, ["W 42 03 01 02 03"]),
        pytest.param("write_block_data", [0x42, [0] * 33], ValueError, NONE, id="33 of a block"),
        ("read_i2c_block_data", [0x10, 3], [0x10, 0x11, 0x12], ["W 10, R 10 11 12"]),
        pytest.param("read_i2c_block_data", [0x10, 33], ValueError, NONE, id="33 to read"),
        pytest.param(
            "read_i2c_block_data", [0], [*range(32)], [f"W 00, R{ALL_32}"], id="as of old"
        ),
        ("write_i2c_block_data", [0x10, [9] * 3], None, ["W 10 09 09 09"]),
        pytest.param("read_block_data", [3], errno.EOPNOTSUPP, NONE, id="no block reads"),
    ],
)
def test_a_call_of_smbus2_is_these_bytes_on_the_wire(
    bus: I2cBusDouble, call: str, arguments: list[object], expected: object, wire: list[str]
) -> None:
    assert outcome(lambda: getattr(SMBus(1), call)(ADDRESS, *arguments)) == expected
    assert [str(each) for each in bus.log] == [f"0x50 {each}" for each in wire]


def outcome(call: Callable[[], object]) -> object:
    """What a call returns, the errno of its error, or its class."""
    try:
        return call()
    except OSError as error:
        return error.errno
    except (TypeError, ValueError) as error:
        return type(error)


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        pytest.param(lambda: SMBus(1).read_byte_data(0x51, 0), EREMOTEIO, id="no chip"),
        pytest.param(lambda: SMBus(1).read_byte(0x80), errno.EINVAL, id="eight bits"),
        pytest.param(lambda: SMBus(1).i2c_rdwr(), errno.EINVAL, id="no messages"),
        pytest.param(lambda: SMBus(1).pec, 0, id="pec"),
        pytest.param(lambda: SMBus(1).funcs, 0x0EFF0009, id="funcs"),
        pytest.param(lambda: SMBus().read_byte(ADDRESS), TypeError, id="before open"),
        pytest.param(lambda: SMBus(7), errno.ENOENT, id="a bus that is not plugged in"),
        pytest.param(lambda: SMBus(1.0), TypeError, id="no number"),  # type: ignore[arg-type]
    ],
)
@pytest.mark.usefixtures("bus")
def test_what_cannot_be_ends_as_with_smbus2(call: Callable[[], object], expected: object) -> None:
    assert outcome(call) == expected


def test_messages_go_to_addresses_of_their_own(bus: I2cBusDouble) -> None:
    bus.connect(Pca9685Double(ManualClock()))
    first, second = i2c_msg.read(ADDRESS, 1), i2c_msg.read(0x40, 1)
    bus.be_behind("i2c-gpio")
    SMBus(1).i2c_rdwr(i2c_msg.write(0x40, [0x00]), second, first)
    assert (bytes(second), bytes(first)) == (b"\x11", b"\x00")


def test_a_bus_is_opened_by_path_or_later_or_for_a_while(bus: I2cBusDouble) -> None:
    later = SMBus()
    with pytest.raises(TypeError):
        later.read_byte(ADDRESS)
    later.open("/dev/i2c-1")
    with SMBus("/dev/i2c-1", force=True) as other:
        assert (later.read_byte_data(ADDRESS, 7), other.read_byte_data(ADDRESS, 8)) == (7, 8)
    with pytest.raises(TypeError):
        other.read_byte(ADDRESS)
    later.close()
    later.close()
    assert bus.errors == 0


def test_an_open_bus_goes_on_with_what_is_plugged_in_later() -> None:
    with plug(1, memory_bus()):
        opened = SMBus(1)
    with pytest.raises(OSError, match="device") as gone:
        opened.read_byte(ADDRESS)
    assert gone.value.errno == errno.ENODEV
    with plug(1, memory_bus()):
        assert opened.read_byte_data(ADDRESS, 5) == 5


def test_two_buses_at_one_number_are_refused(bus: I2cBusDouble) -> None:
    with pytest.raises(ValueError, match=bus.name):
        plug("/dev/i2c-1", [])


@pytest.mark.parametrize(
    ("adapter", "fault", "number"),
    [
        ("bcm2835", NackAddress(), EREMOTEIO),
        ("i2c-gpio", NackAddress(), errno.ENXIO),
        ("bcm2835", StuckSda(), errno.ETIMEDOUT),
        ("designware", AdapterError(errno=errno.EAGAIN), errno.EAGAIN),
    ],
)
def test_a_fault_arrives_with_the_errno_of_the_adapter(
    adapter: str, fault: NackAddress, number: int
) -> None:
    line = memory_bus(adapter)
    line.faults = FaultScript([fault])
    with plug(1, line), pytest.raises(OSError, match=" ") as failed:
        SMBus(1).read_byte_data(ADDRESS, 1)
    assert failed.value.errno == number
    assert isinstance(failed.value, TimeoutError) == (number == errno.ETIMEDOUT)


def test_a_block_is_as_long_as_the_chip_says() -> None:
    with plug(1, memory_bus("i2c-gpio")) as bus:
        port = SMBus(1)
        assert port.read_block_data(ADDRESS, 3) == [4, 5, 6]
        assert port.read_block_data(ADDRESS, 1) == [2]
        assert port.block_process_call(ADDRESS, 1, []) == [3, 4]
        with pytest.raises(OSError, match=" ") as too_long:
            port.read_block_data(ADDRESS, 0x80)
    assert too_long.value.errno == errno.EPROTO
    assert str(bus.log[0]) == "0x50 W 03, R 03 04 05 06"


def test_a_packet_error_code_is_sent_and_checked(bus: I2cBusDouble) -> None:
    port = SMBus(1)
    port.pec = True
    port.write_byte_data(ADDRESS, 0x10, 0x55)
    code = packet_error_code(bytes([ADDRESS << 1, 0x10, 0x55]))
    assert bus.log[-1].written == bytes([0x10, 0x55, code])
    with pytest.raises(OSError, match=" ") as wrong:
        port.read_byte_data(ADDRESS, 0x10)
    assert wrong.value.errno == errno.EBADMSG
    expected = packet_error_code(bytes([ADDRESS << 1, 0x20, ADDRESS << 1 | 1, 0x20]))
    port.enable_pec(False)
    port.write_byte_data(ADDRESS, 0x21, expected)
    port.pec = 1
    assert (port.pec, port.read_byte_data(ADDRESS, 0x20)) == (1, 0x20)


def test_an_adapter_without_packet_error_codes_says_so() -> None:
    with plug(1, memory_bus("designware")), pytest.raises(OSError, match="PEC"):
        SMBus(1).enable_pec()


@pytest.fixture
def pwm_bus() -> Iterator[I2cBusDouble]:
    with plug(1, I2cBusDouble("i2c-1", ManualClock(), [Pca9685Double(ManualClock())])) as bus:
        yield bus


@pytest.fixture
def i2c(pwm_bus: I2cBusDouble) -> Iterator[I2C]:
    with I2C("SCL", "SDA", frequency=400_000) as i2c:
        assert i2c.try_lock()
        yield i2c
    assert pwm_bus.name == "i2c-1"


def test_only_the_part_of_a_buffer_is_written_and_read(i2c: I2C, pwm_bus: I2cBusDouble) -> None:
    answer = bytearray(4)
    i2c.writeto(0x40, b"\x99\x01\x98", start=1, end=2)
    i2c.readfrom_into(0x40, answer, start=1, end=3)
    assert answer == bytes([0, 0x04, 0x04, 0])
    i2c.writeto_then_readfrom(
        0x40, array("B", [7, 0xFE]), answer, out_start=1, out_end=2, in_start=3, in_end=4
    )
    assert answer == bytes([0, 0x04, 0x04, 0x1E])
    assert [str(each) for each in pwm_bus.log] == ["0x40 W 01", "0x40 R 04 04", "0x40 W fe, R 1e"]


def test_without_a_part_the_whole_buffer_is_written_and_read(i2c: I2C) -> None:
    answer = bytearray(2)
    i2c.writeto(0x40, b"\x01")
    i2c.readfrom_into(0x40, answer)
    assert answer == bytes([0x04, 0x04])
    i2c.writeto_then_readfrom(0x40, b"\xfe", answer)
    assert answer[0] == 0x1E


def test_a_chip_that_is_absent_is_an_os_error(i2c: I2C) -> None:
    with pytest.raises(OSError, match=" ") as absent:
        i2c.writeto(0x41, b"")
    assert absent.value.errno == EREMOTEIO


def test_the_bus_is_used_under_its_lock_alone(i2c: I2C) -> None:
    assert not i2c.try_lock()
    i2c.unlock()
    with pytest.raises(RuntimeError, match="lock"):
        i2c.writeto(0x40, b"")
    with pytest.raises(ValueError, match="ocked"):
        i2c.unlock()


def test_a_bus_given_up_is_not_used_and_one_that_is_not_plugged_in_is_not_there(i2c: I2C) -> None:
    assert i2c.scan() == [0x40, 0x70]  # the chip and its all-call address
    i2c.deinit()
    with pytest.raises(ValueError, match="deinit"):
        i2c.scan()
    with pytest.raises(FileNotFoundError):
        I2C(bus=7)
