"""Models of a world in a replay: they send what they sent, when they sent it, and see no world."""

from collections.abc import Callable
from functools import partial
from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions, Wrapped
from firmware_runtime.recording.values import UnknownValue, made
from firmware_runtime.replay.feed import Feed


class PlayedWorld:
    """Stands in the place of models that are none of the robot's own.

    `sent` is what the replay has sent so far in the section, so it says where in the recorded one
    the next value stands.
    """

    def __init__(self, own: frozenset[Atomic], feed: Feed, sent: list[tuple[int, Any]]) -> None:
        self._own = own
        self._feed = feed
        self._sent = sent

    def instrument(self, atomic: Atomic, functions: Functions) -> Functions:
        """A model of the robot's as it is, one of a world played."""
        if atomic in self._own:
            return functions
        play = partial(self._transit, atomic)
        confluent = None if functions.confluent is None else partial(play)
        return Wrapped(atomic, partial(self._output, atomic), play, _external(play), confluent)

    def _output(self, atomic: Atomic) -> None:
        ports = {_number(port): port for port in atomic.out_ports.values()}
        for _ in range(self._feed.world()):
            recorded = self._feed.sent()
            if len(self._sent) >= len(recorded):
                return
            number, form = recorded[len(self._sent)]
            if number not in ports:
                return
            try:
                ports[number].send(made(form))
            except UnknownValue:
                return

    def _transit(self, atomic: Atomic) -> None:
        atomic.sigma = self._feed.world()


def _external(play: Callable[[], None]) -> Callable[[int], None]:
    return lambda _elapsed: play()


def _number(port: Any) -> int:  # noqa: ANN401 -- an output port, listened to
    return int(getattr(port.bag, "number", -1))
