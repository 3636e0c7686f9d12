"""`sndDOVER` and `rcvDOVER`, the blocks by which PowerDEVS speaks with ROS nodes over UDP.

One number a signal: each block has a port number of this machine, and a value is the text that
C's `%f` prints. That text has six decimals: 0.0000004 is sent as 0.000000, so scale what is small.

The blocks only turn numbers into text and back; `links.dover` lets what they say leave, and what
has come arrive.
Source: Pecker Marcosig, Giribet, Castro: DEVS-over-ROS (DoveR), 2018, Figures 5 to 9.
"""

import math
import re
from collections.abc import Callable, Iterable
from typing import Final, TypeVar

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.wire_errors import Fault

Taken = TypeVar("Taken", float, str)

LONGEST_SENT: Final = 18
"""Characters; the papers' ROS node reads no more, and a number cut off is another number."""
LONGEST_RECEIVED: Final = 200
"""Characters; what the papers' sender has room for."""
HIGHEST_PORT: Final = 0xFFFF

_NUMBER = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)[\s\0]*", re.ASCII | re.IGNORECASE
)
_NOT_FINITE = re.compile(r"\s*[+-]?(?:inf|nan)", re.IGNORECASE)
_SHOWN = 40


class Refused(ValueError):
    """A number that has no text, or a text that is no number; `kind` names the reason."""

    def __init__(self, kind: str, sentence: str) -> None:
        self.kind = kind
        super().__init__(sentence)


def text_of_number(value: float) -> str:
    """A number as `%f` prints it. Raises Refused if it is not finite, or its text too long."""
    if not math.isfinite(value):
        raise Refused("NotFinite", f"{value}; expected a finite number")
    text = f"{value:f}"
    if len(text) > LONGEST_SENT:
        fault = f"{value:g} has {len(text)} characters; expected {LONGEST_SENT} at most"
        raise Refused("TooLong", fault)
    return text


def number_of_text(text: str) -> float:
    """The number that a text is, of `%f` or any other decimal. Raises Refused."""
    if len(text) > LONGEST_RECEIVED:
        fault = f"{len(text)} characters; expected {LONGEST_RECEIVED} at most"
        raise Refused("TooLong", fault)
    found = _NUMBER.fullmatch(text)
    value = float(found[1]) if found else math.nan
    if math.isfinite(value):
        return value
    kind = "NotFinite" if found or _NOT_FINITE.match(text) else "Malformed"
    raise Refused(kind, f"{text[:_SHOWN]!r}; expected a finite number, such as 0.500000")


class DoverBlock(Atomic):
    """Base of both blocks: a port number of UDP, and the count of what was refused in a row.

    waiting --in?--> passing (0) --out! | fault!--> waiting

    A subclass declares its two ports, and calls `_pass` with what turns the values of one into
    those of the other.
    """

    has_dover_link = True
    """What a run looks for before it imports what carries the texts."""

    def __init__(self, name: str, udp_port: int) -> None:
        super().__init__(name)
        if type(udp_port) is not int or not 0 < udp_port <= HIGHEST_PORT:
            fault = f"{udp_port!r} is no port of UDP; expected 1 to {HIGHEST_PORT}"
            raise ConfigError.of_one(name, fault)
        self.udp_port = udp_port
        self.fault = self.out_port("fault", Fault)
        self.refused = 0
        """How many have been refused in a row."""
        self._passed: list[object] = []
        self._faults: list[Fault] = []

    def output(self) -> None:
        """Send what was turned, in the order in which it came, and what was refused."""
        (out,) = (port for port in self.out_ports.values() if port is not self.fault)
        for each in self._passed:
            out.send(each)
        for fault in self._faults:
            self.fault.send(fault)

    def internal(self) -> None:
        """Wait for the next."""
        self._passed.clear()
        self._faults.clear()
        self.passivate("waiting")

    def _pass(self, taken: Iterable[Taken], turned: Callable[[Taken], object]) -> None:
        """Turn numbers into texts, or back, at once; what is refused is a fault."""
        for each in taken:
            try:
                self._passed.append(turned(each))
            except Refused as why:
                self.refused += 1
                sentence = f"{self.path}, port {self.udp_port}: {why}"
                self._faults.append(Fault(why.kind, sentence, self.refused))
            else:
                self.refused = 0
        self.activate("passing")


class SndDover(DoverBlock):
    """Sends each value as text to a UDP port of this machine (Figures 7 and 8)."""

    def __init__(self, name: str, udp_port: int) -> None:
        super().__init__(name, udp_port)
        self.value = self.in_port("value", float, takes="any")
        self.text = self.out_port("text", str)

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- what waits, waits for no time
        """Put values into words."""
        self._pass(self.value, text_of_number)


class RcvDover(DoverBlock):
    """Passes on each number that comes to a UDP port of this machine (Figure 5).

    Several blocks may have one port: each gets all that comes there. `text` is fed by the link,
    from outside of the model; it need not be coupled.
    """

    def __init__(self, name: str, udp_port: int) -> None:
        super().__init__(name, udp_port)
        self.text = self.in_port("text", str)
        self.value = self.out_port("value", float)

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- what waits, waits for no time
        """Read the texts."""
        self._pass(self.text, number_of_text)
