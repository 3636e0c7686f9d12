"""Brook, flow meter on a serial line (example, rev. 1): frames to SI units.

It speaks only when it is asked. The caller of the driver waits for the answer.
"""

from typing import Final

from firmware_drivers.chips.step import Step

from firmware_runtime import MILLISECOND, NotReady, WrongDevice
from firmware_runtime.hal.serial import SerialPort

BAUD: Final = 9600
START, IDENTITY, FLOW = 0x3A, 0x49, 0x46
BROOK: Final = 0x4252
ANSWER_LENGTH: Final = 5
ANSWER_NS: Final = 26 * MILLISECOND
"""20 ms, and the time of five bytes; from when the last byte that asks has left."""


def check_of(body: bytes) -> int:
    """What ends a frame."""
    return 0xFF - sum(body) % 0x100


class FrameDecoder:
    """Bytes in, answers out; bytes may be cut anywhere, and whatever is no frame is skipped."""

    def __init__(self) -> None:
        self._bytes = b""

    def restart(self) -> None:
        """Forget a frame that has begun."""
        self._bytes = b""

    def feed(self, data: bytes) -> list[tuple[int, int]]:
        """Take what has arrived; return command and number of each answer, in order."""
        answers = []
        self._bytes += data
        while len(self._bytes) >= ANSWER_LENGTH:
            frame = self._bytes[:ANSWER_LENGTH]
            is_whole = frame[0] == START and frame[-1] == check_of(frame[1:-1])
            if is_whole:
                answers.append((frame[1], int.from_bytes(frame[2:4])))
            self._bytes = self._bytes[ANSWER_LENGTH if is_whole else 1 :]
        return answers


class Brook:
    """One Brook: after `bring_up` ask for the flow, let ANSWER_NS pass, read it."""

    def __init__(self, port: SerialPort) -> None:
        self.line = self._port = port
        self.place = f"Brook on {port.name}"
        self._decoder = FrameDecoder()
        self._asked = FLOW

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps to ready; they raise NotReady, WrongDevice, BusFault or PortClosed."""
        return (
            Step("ask", lambda: self._ask(IDENTITY), ANSWER_NS),
            Step("identify", self._identify, 0),
        )

    def ask_flow(self) -> None:
        """Ask; what has arrived before is of no more use, and goes."""
        self._ask(FLOW)

    def read_flow_l_s(self) -> float:
        """Take the answer, l/s. Raises NotReady if there is none; BusFault or PortClosed."""
        return self._answer() / 1000

    def _identify(self) -> None:
        if (found := self._answer()) != BROOK:
            raise WrongDevice(f"identity {found:04x}", where=self.place, expected=f"{BROOK:04x}")

    def _ask(self, command: int) -> None:
        self._asked = command
        self._decoder.restart()
        self._port.discard_input()
        self._port.write(bytes((START, command, check_of(bytes((command,))))))

    def _answer(self) -> int:
        arrived = self._port.read_available()
        for command, number in self._decoder.feed(arrived):
            if command == self._asked:
                return number
        came = arrived.hex(" ") or "nothing"
        expected = f"an answer to {self._asked:02x}"
        raise NotReady(f"{came} arrived", where=self.place, expected=expected)
