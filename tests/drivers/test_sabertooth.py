import math

import pytest
from firmware_drivers.chips.sabertooth import Sabertooth, SabertoothSettings, packet, speed_packet
from firmware_drivers.chips.step import duration_ns
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.serial import SerialPort

TENTH = 100_000_000


class RecordingPort(SerialPort):
    name = "ttyS0"

    def __init__(self) -> None:
        self.written: list[bytes] = []

    def write(self, data: bytes) -> None:
        self.written.append(data)

    def read_available(self) -> bytes:
        raise AssertionError("the line has one direction only")

    def close(self) -> None:
        self.written.clear()


@pytest.fixture
def port() -> RecordingPort:
    return RecordingPort()


# Packets ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("address", "command", "value", "sent"),
    [
        (128, 0, 63, "80 00 3f 3f"),
        (128, 5, 63, "80 05 3f 44"),
        (128, 14, 3, "80 0e 03 11"),
        (130, 0, 64, "82 00 40 42"),
        (135, 127, 127, "87 7f 7f 05"),
    ],
)
def test_a_packet_ends_in_the_low_seven_bits_of_its_sum(
    address: int, command: int, value: int, sent: str
) -> None:
    assert packet(address, command, value).hex(" ") == sent


@given(st.integers(128, 135), st.integers(0, 127), st.integers(0, 127))
def test_only_the_first_byte_of_a_packet_has_its_high_bit_set(
    address: int, command: int, value: int
) -> None:
    first, *others = packet(address, command, value)
    assert first == address
    assert all(byte < 128 for byte in others)


@pytest.mark.parametrize(
    ("address", "command", "value"), [(127, 0, 0), (136, 0, 0), (128, 128, 0), (128, 0, 128)]
)
def test_a_packet_of_what_does_not_fit_is_refused(address: int, command: int, value: int) -> None:
    with pytest.raises(ValueError, match="expected 128 to 135 and twice 0 to 127"):
        packet(address, command, value)


@pytest.mark.parametrize(
    ("speed", "sent"),
    [
        (0.0, "80 04 00 04"),
        (-0.0, "80 04 00 04"),
        (1.0, "80 04 7f 03"),
        (-1.0, "80 05 7f 04"),
        (0.5, "80 04 40 44"),
        (-1 / 127, "80 05 01 06"),
        (-0.001, "80 04 00 04"),
    ],
)
def test_direction_is_the_command_and_speed_the_value(speed: float, sent: str) -> None:
    assert speed_packet(128, 4, speed).hex(" ") == sent


# The driver ---------------------------------------------------------------------------------------


def test_bring_up_sends_the_autobaud_byte_if_it_takes_one_then_timeout_and_stop(
    port: RecordingPort,
) -> None:
    autobaud, stop = Sabertooth(port).bring_up()
    autobaud.action()
    assert port.written == [b"\xaa"]
    assert autobaud.wait_ns == 500_000_000
    stop.action()
    assert port.written.pop().hex(" ") == "80 0e 03 11 80 00 00 00 80 04 00 04"
    port.written.clear()
    steps = Sabertooth(port, settings=SabertoothSettings(autobaud=False)).bring_up()
    for step in steps:
        step.action()
    assert duration_ns(steps) == 0
    assert not any(b"\xaa" in sent for sent in port.written)


def test_speeds_go_out_in_one_write_and_bring_the_timeout_along(port: RecordingPort) -> None:
    chip = Sabertooth(port, 129, SabertoothSettings(timeout_ns=5 * TENTH))
    chip.set_speeds(1.0, -0.5)
    assert [sent.hex(" ") for sent in port.written] == ["81 0e 05 14 81 00 7f 00 81 05 40 46"]
    assert chip.timeout_ns == 5 * TENTH


@pytest.mark.parametrize("speed", [1.001, -1.001, math.nan, math.inf])
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_speed_that_is_none_is_refused_and_nothing_is_sent(
    port: RecordingPort, side: str, speed: float
) -> None:
    with pytest.raises(ValueError, match=r"Sabertooth 128 on ttyS0: speeds .*, expected -1 to 1"):
        Sabertooth(port).set_speeds(**{"left": 0.0, "right": 0.0, side: speed})
    assert port.written == []


@pytest.mark.parametrize(
    ("address", "timeout_ns", "fault"),
    [
        *(
            (128, timeout_ns, r"expected 0\.1 s to 12\.7 s in steps of 0\.1 s")
            for timeout_ns in (0, TENTH // 2, TENTH + 1, 128 * TENTH, -TENTH)
        ),
        (136, TENTH, "address: 136, expected 128 to 135"),
    ],
)
def test_a_timeout_or_an_address_it_cannot_have_is_refused_and_off_is_none_of_them(
    port: RecordingPort, address: int, timeout_ns: int, fault: str
) -> None:
    with pytest.raises(SettingError, match=fault):
        Sabertooth(port, address, SabertoothSettings(timeout_ns=timeout_ns))
