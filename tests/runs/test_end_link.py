"""The link of an end, opened for a run: what leaves its part of the model arrives at the other."""

from collections.abc import Sequence
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from firmware_runtime.board.ends import BoardEnd, end_of
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.part import part_of
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import MonotonicClock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.inbox import Bag
from firmware_runtime.links.cut import link as module
from firmware_runtime.runs.end_link import open_link
from firmware_runtime.runs.start import start_session, way_of
from tests.support.link_rig import Way
from tests.support.periodic_models import PERIOD, Actuator, Sampler


class End:
    """Of a model of two, the one that runs here."""

    def __init__(self, own: str, other: str) -> None:
        whole = Coupled("rover")
        mind, wheels = whole.add(Sampler("mind")), whole.add(Actuator("wheels"))
        whole.couple(mind.sample, wheels.command)
        part = part_of(whole, [own])
        crossings = frozenset({"mind.sample"})
        end = BoardEnd(own, own, (own,), (other,), own == "wheels", crossings)
        self.sent: list[bytes] = []
        self.way = Way(self.sent.append)
        configuration = Configuration(has_link=True)
        self.executive = Executive(part.model, VirtualClock(), configuration=configuration)
        board = registry.load("tachobot")
        self.link = open_link(board, end, part, self.executive, lambda _: self.way, log=print)

    def speak_to(self, other: "End", at: int = 0) -> Sequence[Bag]:
        """Let what it sends between two steps arrive at the other end."""
        self.link.between_steps(at, 0)
        other.way.waits.extend(self.sent)
        self.sent.clear()
        return other.link.events()


def test_what_leaves_an_end_in_a_step_enters_the_model_of_the_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [SECOND]
    monkeypatch.setattr(module, "Link", partial(module.Link, time=lambda: now[0]))
    mind, wheels = End("mind", "wheels"), End("wheels", "mind")
    for _ in range(3):  # they meet
        now[0] += SECOND // 10
        mind.speak_to(wheels)
        wheels.speak_to(mind)
    for number, at in enumerate((0, PERIOD)):
        mind.executive.simulator.advance(at)
        [bag] = mind.speak_to(wheels, at)
        [(port, value)] = bag
        assert (port.name, value) == ("mind:sample", number)


@pytest.mark.parametrize(
    ("role", "link", "refused"),
    [
        ("robot", None, "drives nothing without a controller"),
        (None, "unix:/no/link", "--link without --role"),
    ],
)
def test_an_end_with_hardware_and_a_link_are_refused_without_each_other(
    role: str | None, link: str | None, refused: str
) -> None:
    board = registry.load("tachobot")
    end = None if role is None else end_of(board, role)
    with pytest.raises(ConfigError, match=refused):
        start_session(
            board,
            MonotonicClock(),
            doubles=True,
            statistics_path=None,
            end=end,
            link=way_of(link),
        )


@pytest.mark.parametrize("is_linked", [False, True])
def test_only_a_run_with_a_link_counts_what_passes_on_one(
    tmp_path: Path, *, is_linked: bool
) -> None:
    board = registry.load("tachobot")
    link = way_of(f"unix:{tmp_path}/link" if is_linked else None)
    end = end_of(board, "controller")
    clock = MonotonicClock()
    with closing(
        start_session(board, clock, doubles=False, statistics_path=None, end=end, link=link)
    ) as session:
        assert (session.executive.statistics.figures().link is not None) is is_linked
