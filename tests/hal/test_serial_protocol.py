import pytest

from firmware_runtime.hal.serial import SerialPort


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
