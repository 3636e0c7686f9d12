"""Tapped output ports: each value goes into a list, after the number of its port.

`tap` changes the class of a port in place, so it stays the same object: what holds it goes on
sending by it, and noting a value costs no further call.
"""

from collections import deque
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.ports import NOWHERE, OutPort, Register

Sent: TypeAlias = list[Any]
"""Number of a port and value, in turns: one list, since a pair would be an object for each."""
NOT_NOTED: Final[Register] = deque(maxlen=0)


class TappedPort(OutPort[Any]):
    """An output port that appends its number and the value to `sent`, then sends.

    Of a value of another class than `kind`, or of which `look` returns other than what was `seen`,
    it appends itself and the value's place to `unlike`.
    """

    __slots__ = ()

    def send(self, value: object) -> None:
        """Deliver one value to every port coupled to this one."""
        sent = self.sent  # named, so that CPython appends to it without a call
        sent.append(self.number)
        sent.append(value)
        look = self.look
        if type(value) is not self.kind or (look is not None and look(value) != self.seen):
            self.unlike.append(self)
            self.unlike.append(len(sent) - 1)
        bag = self.bag
        if bag is not NOWHERE:
            if not bag:
                self.register.append(self.entry)
            bag.append(value)

    @property
    def leads_somewhere(self) -> bool:
        """True, whether or not anything else listens: the tap does.

        A model that asks makes its value in every recorded run, so that the same leaves it in a
        replay, where there is no `--trace` and no plot, as in the run, where there may have been. A
        recording does not depend on who else listened, and has the value for `export` and `debug`.
        """
        return True


def tap(port: OutPort[Any], number: int, sent: Sent, unlike: Register = NOT_NOTED) -> None:
    """From now on, append what leaves a port to `sent`, by this number; all is unlike at first."""
    port.number, port.sent = number, sent
    port.kind = port.look = port.seen = None
    port.unlike = unlike
    port.__class__ = TappedPort
