"""Models of a world in a replay: they send what they sent, when they sent it, and see no world."""

from contextlib import suppress
from functools import partial
from typing import Any

import msgspec

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions, Wrapped
from firmware_runtime.devs.tapped_ports import Sent
from firmware_runtime.devs.time import NEVER
from firmware_runtime.recording.replay.feed import Feed


class PlayedWorld:
    """Stands in the place of models that are none of the robot's own.

    `sent` is what the replay has sent so far in the section, so it says where in the recorded one
    the next value stands.
    """

    def __init__(self, own: frozenset[Atomic], feed: Feed, sent: Sent) -> None:
        self._own = own
        self._feed = feed
        self._sent = sent

    def instrument(self, atomic: Atomic, functions: Functions) -> Functions:
        """A model of the robot's as it is, one of a world played."""
        if atomic in self._own:
            return functions
        internal = partial(self._transit, atomic)
        confluent = None if functions.confluent is None else partial(internal)
        external = partial(self._reached, atomic)
        return Wrapped(atomic, partial(self._output, atomic), internal, external, confluent)

    def _output(self, atomic: Atomic) -> None:
        ports = {port.number: port for port in atomic.out_ports.values()}
        for _ in range(self._feed.world(0)):
            recorded = self._feed.world_sent(len(self._sent) // 2, ports)
            if recorded is None:
                return
            number, form = recorded
            port = ports[number]
            port.send(_value(form, port.type))

    def _transit(self, atomic: Atomic) -> None:
        atomic.sigma = self._feed.world(NEVER)

    def _reached(self, atomic: Atomic, elapsed: int) -> None:
        left = NEVER if atomic.sigma == NEVER else max(0, atomic.sigma - elapsed)
        atomic.sigma = self._feed.world(left)


def _value(form: Any, kind: type[Any]) -> Any:  # noqa: ANN401 -- whatever its port carries
    """The value that was written in this form; the form itself where no such value can be made."""
    with suppress(msgspec.ValidationError, TypeError):
        return msgspec.convert(form, kind)
    return form
