"""Output ports that are heard: each value goes into a list, after the number of its port.

A port becomes such a one in its place, by `hear`, and is no other object than before: what holds it
goes on sending by it, and that a value is heard costs no call more.
"""

from typing import Any, TypeAlias

from firmware_runtime.devs.ports import NOWHERE, OutPort

Sent: TypeAlias = list[Any]
"""Number of a port and value, in turns: one list, since a pair would be an object for each."""


class HeardPort(OutPort[Any]):
    """An output port that appends its number and the value to `sent`, then sends."""

    __slots__ = ()

    def send(self, value: object) -> None:
        """Deliver one value to every port coupled to this one."""
        sent = self.sent  # named, so that CPython appends to it without a call
        sent.append(self.number)
        sent.append(value)
        bag = self.bag
        if bag is not NOWHERE:
            if not bag:
                self.register.append(self.entry)
            bag.append(value)

    @property
    def leads_somewhere(self) -> bool:
        """True, whether or not anything else listens: the recording is what listens.

        A model that asks makes its value in every recorded run, so that the same leaves it in a
        replay, where there is no `--trace` and no plot, as in the run, where there may have been. A
        recording does not depend on who else listened, and has the value for `export` and `debug`.
        """
        return True


def hear(port: OutPort[Any], number: int, sent: Sent) -> None:
    """From now on, append what leaves a port to `sent`, by this number."""
    port.number, port.sent = number, sent
    port.__class__ = HeardPort
