"""smbus2 on doubles: what its calls put on the wire, their answers and errors."""

import errno
from collections.abc import Callable, Iterator

import pytest

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


CALLS: dict[str, tuple[Callable[[SMBus], object], object, list[str]]] = {
    "write_quick": (lambda bus: bus.write_quick(ADDRESS), None, ["0x50 W"]),
    "read_byte": (lambda bus: bus.read_byte(ADDRESS, force=True), 0, ["0x50 R 00"]),
    "write_byte": (lambda bus: bus.write_byte(ADDRESS, 0x21), None, ["0x50 W 21"]),
    "a byte too large": (lambda bus: bus.write_byte(ADDRESS, 0x121), None, ["0x50 W 21"]),
    "a negative byte": (lambda bus: bus.write_byte_data(ADDRESS, 3, -1), None, ["0x50 W 03 ff"]),
    "a byte that is none": (
        lambda bus: bus.write_byte_data(ADDRESS, 3, 1.5),  # type: ignore[arg-type]
        TypeError,
        [],
    ),
    "read_byte_data": (
        lambda bus: bus.read_byte_data(ADDRESS, 0x42),
        0x42,
        ["0x50 W 42, R 42"],
    ),
    "write_byte_data": (
        lambda bus: bus.write_byte_data(ADDRESS, 0x42, 7, force=False),
        None,
        ["0x50 W 42 07"],
    ),
    "read_word_data": (
        lambda bus: bus.read_word_data(ADDRESS, 0x42),
        0x4342,
        ["0x50 W 42, R 42 43"],
    ),
    "write_word_data": (
        lambda bus: bus.write_word_data(ADDRESS, 0x42, 0x1234),
        None,
        ["0x50 W 42 34 12"],
    ),
    "process_call": (
        lambda bus: bus.process_call(ADDRESS, 0x42, 0x1234),
        0x4544,
        ["0x50 W 42 34 12, R 44 45"],
    ),
    "write_block_data": (
        lambda bus: bus.write_block_data(ADDRESS, 0x42, [1, 2, 3]),
        None,
        ["0x50 W 42 03 01 02 03"],
    ),
    "33 bytes of a block": (
        lambda bus: bus.write_block_data(ADDRESS, 0x42, [0] * 33),
        ValueError,
        [],
    ),
    "read_i2c_block_data": (
        lambda bus: bus.read_i2c_block_data(ADDRESS, 0x10, 3),
        [0x10, 0x11, 0x12],
        ["0x50 W 10, R 10 11 12"],
    ),
    "33 bytes to read": (
        lambda bus: bus.read_i2c_block_data(ADDRESS, 0x10, 33),
        ValueError,
        [],
    ),
    "write_i2c_block_data": (
        lambda bus: bus.write_i2c_block_data(ADDRESS, 0x10, [9] * 3),
        None,
        ["0x50 W 10 09 09 09"],
    ),
    "no chip there": (
        lambda bus: bus.read_byte_data(0x51, 0),
        errno.EREMOTEIO,
        ["0x51 W 00, R -> errno 121"],
    ),
    "an address of eight bits": (lambda bus: bus.read_byte(0x80), errno.EINVAL, []),
    "no messages": (lambda bus: bus.i2c_rdwr(), errno.EINVAL, []),
    "pec": (lambda bus: bus.pec, 0, []),
    "funcs": (lambda bus: bus.funcs, 0x0EFF0009, []),
    "before open": (lambda _: SMBus().read_byte(ADDRESS), TypeError, []),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_call_of_smbus2_is_these_bytes_on_the_wire(name: str, bus: I2cBusDouble) -> None:
    call, expected, wire = CALLS[name]
    try:
        found = call(SMBus(1))
    except OSError as error:
        found = error.errno
    except (TypeError, ValueError) as error:
        found = type(error)
    assert found == expected
    assert [str(each) for each in bus.log] == wire


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


def test_a_bus_that_is_not_plugged_in_is_not_there() -> None:
    with pytest.raises(FileNotFoundError):
        SMBus(1)
    with pytest.raises(TypeError):
        SMBus(1.0)  # type: ignore[arg-type]


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
        ("bcm2835", NackAddress(), errno.EREMOTEIO),
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
        assert port.block_process_call(ADDRESS, 1, []) == [3, 4]
        with pytest.raises(OSError, match=" ") as too_long:
            port.read_block_data(ADDRESS, 0x80)
    assert too_long.value.errno == errno.EPROTO
    assert str(bus.log[0]) == "0x50 W 03, R 03 04 05 06"


def test_an_adapter_without_block_reads_refuses_them(bus: I2cBusDouble) -> None:
    with pytest.raises(OSError, match=" ") as refused:
        SMBus(1).read_block_data(ADDRESS, 3)
    assert (refused.value.errno, bus.transactions) == (errno.EOPNOTSUPP, 0)


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


def test_the_older_smbus_reads_32_bytes_by_default(bus: I2cBusDouble) -> None:
    assert SMBus(1).read_i2c_block_data(ADDRESS, 0) == list(range(32))
    assert bus.bytes == 35
