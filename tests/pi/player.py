"""A board's doubles as the chips of the emulated computer, in a thread of this process.

What is sent to the memories is in QEMU's trace, which is a pipe; the doubles take it in order. What
they make of it goes to the guest, where a program writes it into the memories: the lines to its
console. At the pins of its UART are a sonar of the board's, if it has one there, and a Sabertooth.
"""

import os
import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from select import select
from time import monotonic, monotonic_ns
from typing import Final

from firmware_runtime.board import registry
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.system.resources import Closing
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.register_ram import Puppet, Shown
from sim_doubles.rigs.board_rig import DoublesRig, rig_for
from sim_doubles.serial_line import SerialTarget
from sim_doubles.serial_pty import PtySerialLine
from sim_doubles.served.server import RealClock
from tests.pi.computer import MONITOR, NOTE, NOWHERE, TRACE, Monitor
from tests.pi.guest.emulated import MAY_DRIVE
from tests.pi.guest.hand import with_checksum
from tests.pi.guest.settings import text_of
from tests.pi.watch import Sent, Trace, Watch

PERIOD_S: Final = 0.02
"""From one look at what the doubles measure to the next."""
PIECE: Final = 65536


class AtTheUart(SerialTarget):
    """A sonar that sends and a Sabertooth that receives, each on one of the two wires."""

    def __init__(self) -> None:
        self.sonar: SerialPort | None = None
        self._motors = SabertoothDouble(monotonic_ns)
        self._fastest = 0.0

    def receive(self, data: bytes) -> None:
        """Let the motors' driver take bytes; how fast they turned until then is noted."""
        self._fastest = max(self._fastest, *map(abs, self._motors.speeds))
        self._motors.receive(data)

    def transmitted(self, at: int) -> bytes:  # noqa: ARG002 -- the sonar has the clock
        """Return what the sonar has sent."""
        return b"" if self.sonar is None else self.sonar.read_available()

    def power_cycle(self) -> None:
        """The motors' driver loses its supply."""
        self._motors.power_cycle()

    def line(self) -> str:
        """Return how the motors turned, as a line of the guest."""
        what = "the Sabertooth at the UART turned and was stopped"
        has_passed = self._fastest > 0 and self._motors.speeds == (0, 0)
        said = f"{self._fastest:.2f} of full speed at most, now {self._motors.speeds}"
        return f"{'ok' if has_passed else 'FAILED'} {what} ({said})"


class Player(Closing):
    """Plays from construction on, once the checks have asked for a board's chips.

    `console` is what QEMU reads as the input of the guest's console, `uart_path` what it has at the
    pins of the UART. Who sent which message is in the file i2c.log.
    """

    def __init__(self, logs: Path, timeout_ms: int) -> None:
        self.watch = Watch()
        self.carried: dict[int, bytes] = {}
        """Pieces of a file from there, by number."""
        self._logs = logs
        self._timeout_ms = timeout_ms
        self._clock = RealClock()
        self.uart = AtTheUart()
        self._uart = PtySerialLine(self.uart, monotonic_ns)
        self.uart_path = self._uart.path
        self._rig: DoublesRig | None = None
        self._puppet: Puppet | None = None
        self._trace = Trace()
        self._asked: SimpleQueue[str] = SimpleQueue()
        self._stopped = False
        self._resources = ExitStack()
        self._resources.callback(self._uart.close)
        pipe = logs / TRACE
        pipe.unlink(missing_ok=True)
        os.mkfifo(pipe)
        self._pipe = os.open(pipe, os.O_RDWR | os.O_NONBLOCK)  # never at its end
        self._resources.callback(os.close, self._pipe)
        self.console, self._hand = os.pipe()
        os.set_blocking(self._hand, False)
        self._resources.callback(os.close, self._hand)
        self._resources.callback(os.close, self.console)
        self._log = self._resources.enter_context((logs / "i2c.log").open("w"))
        self._thread = threading.Thread(target=self._play, name="player", daemon=True)
        self._thread.start()

    def ask(self, what: str) -> None:
        """Do what the checks ask for: `board NAME`, `vanish ADDRESS`, `return ADDRESS`."""
        self._asked.put(what)

    def close(self) -> None:
        """End the thread."""
        self._stopped = True
        self._thread.join()
        self._resources.close()

    # In the thread ------------------------------------------------------------------------------

    def _play(self) -> None:
        looks_at = 0.0
        while not self._stopped:
            select((self._pipe, self._uart.fileno()), (), (), PERIOD_S)
            self._clock.look()
            has_news = self._take_sent()
            with suppress(Empty):
                self._carry_out(*self._asked.get_nowait().split())
            if has_news or monotonic() >= looks_at:
                looks_at = monotonic() + PERIOD_S
                self._look()

    def _take_sent(self) -> bool:
        """Take what was sent meanwhile; return whether some of it was the host's."""
        try:
            piece = os.read(self._pipe, PIECE)
        except BlockingIOError:
            return False
        is_news = False
        for sent in self._trace.messages(piece):
            if sent.address == NOTE:
                self._take_note(*sent.message)
            elif self._rig is not None and self._puppet is not None:
                is_news |= self._taken(sent, self._rig, self._puppet)
        return is_news

    def _take_note(self, register: int, *content: int) -> None:
        if register == MAY_DRIVE:
            self.watch.may_drive = bool(content[0])
            self._note("outputs may be on" if self.watch.may_drive else "none may be on")
        else:
            self.carried[int.from_bytes(content[:2], "big")] = bytes(content[2:])

    def _taken(self, sent: Sent, rig: DoublesRig, puppet: Puppet) -> bool:
        is_hosts = puppet.sent(sent.address, sent.message)
        self._note(f"{'host  ' if is_hosts else 'puppet'} {sent}")
        if is_hosts:
            self.watch.take(sent, rig.outputs)
        return is_hosts

    def _look(self) -> None:
        self._uart.pump()
        if self._rig is None or self._puppet is None:
            return
        self._rig.catch_up()
        self._puppet.step()
        if (body := self._rig.ports.get("body")) and (sent := body.read_available()):
            self._say(f"body {sent.hex()}")

    def _carry_out(self, what: str, which: str) -> None:
        """Raise KeyError, OSError or ValueError where that cannot be; the checks end then."""
        self._note(f"{what} {which}")
        carry_out: dict[str, Callable[[str], None]] = {
            "board": self._be,
            "vanish": lambda chip: self._place(int(chip, 16), NOWHERE),
            "return": self._return,
        }
        carry_out[what](which)

    def _be(self, name: str) -> None:
        """Be this board's chips from now on, as after power-up."""
        self._clock = RealClock()  # a board's world begins at 0
        file = self._logs / f"{name}.toml"
        file.write_text(text_of(name, self._timeout_ms), encoding="utf-8")
        self._rig = rig = rig_for(registry.load(str(file)), self._clock)
        chips = [each for each in rig.buses["i2c1"].targets if isinstance(each, Shown)]
        for chip in chips:
            if isinstance(chip, Mpu9250Double):
                chip.reset_time = 0  # it learns of a reset late, and the host has waited by then
        self._puppet = Puppet(rig.buses["i2c1"], chips, self._clock, self._write)
        self.uart.sonar = rig.ports.get("uart")

    def _return(self, chip: str) -> None:
        address = int(chip, 16)
        self._place(address, address)
        if self._puppet is not None:
            self._puppet.power_cycle(address)

    def _place(self, chip: int, address: int) -> None:
        Monitor(self._logs / MONITOR).place(chip, address)

    def _write(self, address: int, message: bytes) -> None:
        self._say(f"{address:02x} {message.hex()}")

    def _say(self, line: str) -> None:
        """Say a line to the guest; one that it has no room for is lost, and sent again in time."""
        with suppress(BlockingIOError):
            os.write(self._hand, with_checksum(line.encode("ascii")) + b"\n")

    def _note(self, line: str) -> None:
        self._log.write(f"{monotonic():.3f} {line}\n")
