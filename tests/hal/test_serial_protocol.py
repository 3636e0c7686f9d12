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


@pytest.mark.parametrize("arrivals", [(), (b"R123\r",), (b"R12", b"3\r", b"R")])
def test_discarding_takes_everything_that_arrived_in_however_many_parts(
    arrivals: tuple[bytes, ...],
) -> None:
    port = ScriptedPort(*arrivals)
    port.discard_input()
    assert port.arrivals == []
    assert port.read_available() == b""


def test_discarding_leaves_what_comes_afterwards() -> None:
    port = ScriptedPort(b"old", b"", b"new")
    port.discard_input()
    assert port.read_available() == b"new"
