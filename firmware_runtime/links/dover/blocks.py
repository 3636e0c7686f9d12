"""Which of the paper's blocks in a model speak with the network, and the way to those that receive.

A block whose `text` is coupled within the model speaks with that, and not with the network: so a
model of both ends runs in virtual time too.
"""

from typing import TypeAlias

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled, with_all_below
from firmware_runtime.devs.ports import InPort, Owner
from firmware_runtime.executive.clocks import Clock, VirtualClock
from firmware_runtime.models.dover import DoverBlock, RcvDover, SndDover

Entrances: TypeAlias = dict[int, InPort[str]]
"""Input ports of the top model by the port of UDP whose texts they take."""


class DoverBlocks:
    """The blocks of a model that speak with the network; draws couplings to the receivers.

    The model must not be on an executive yet. In virtual time there is no network, and none speaks.
    """

    def __init__(self, root: Component, clock: Clock) -> None:
        is_virtual = isinstance(clock, VirtualClock)
        blocks = [
            each
            for each in with_all_below(root)
            if isinstance(each, DoverBlock) and not (is_virtual or _is_coupled(each))
        ]
        self.senders = [each for each in blocks if isinstance(each, SndDover)]
        self.entrances: Entrances = {}
        for block in blocks:
            if isinstance(block, RcvDover):
                self.entrances[block.udp_port] = _entrance(block, root)

    def __bool__(self) -> bool:
        return bool(self.senders or self.entrances)


def _is_coupled(block: DoverBlock) -> bool:
    """Whether something within the model feeds its text, or takes it."""
    if not isinstance(block.parent, Coupled):
        return False
    port = {**block.in_ports, **block.out_ports}["text"]
    return any(port in coupling for coupling in block.parent.couplings)


def _entrance(block: RcvDover, root: Component) -> InPort[str]:
    """The root's input port for a block, coupled down to it; blocks of one port share it."""
    above: Owner | None = block.parent
    end = block.text
    while isinstance(above, Coupled):
        name = f"dover:{block.udp_port}"
        begin = above.in_ports[name] if name in above.in_ports else above.in_port(name, str)
        if (begin, end) not in above.couplings:
            above.couple(begin, end)
        if above is root:
            return begin
        end, above = begin, above.parent
    return end
