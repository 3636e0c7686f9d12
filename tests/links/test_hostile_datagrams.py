"""Hostile datagrams: every one is judged as the document says.

There are 2,000 for each target and seed, or FIRMWARE_RUNTIME_HOSTILE_DATAGRAMS.
"""

import math
import os
from collections.abc import Callable
from random import Random

import pytest

from firmware_runtime.models.motion import Motion
from tests.support.hostile.bridge import BridgeTarget
from tests.support.hostile.frames import HEADER, YAW_LIMIT
from tests.support.hostile.link import LinkTarget
from tests.support.hostile.sweep import ACCEPTED, Attempt, Result, Target, result_text, sweep

TARGETS: list[Callable[[int], Target]] = [BridgeTarget, LinkTarget]


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("seed", [1, 2])
def test_every_datagram_is_judged_as_the_document_says(
    target: Callable[[int], Target], seed: int
) -> None:
    count = int(os.environ.get("FIRMWARE_RUNTIME_HOSTILE_DATAGRAMS", "2000"))
    result = sweep(target(seed), count)
    assert result.is_clean, result_text("sweep", result)
    assert result.verdicts[ACCEPTED] > count / 10
    assert len(result.verdicts) > 8


@pytest.mark.slow
@pytest.mark.parametrize(
    ("function", "instead"),
    [
        ("firmware_runtime.links.cut.udp.opened", lambda datagram, _key: datagram[:-32]),
        ("firmware_runtime.links.cut.window.Window.judge", lambda *_: None),
        ("firmware_runtime.links.cut.peer.PeerClock.age", lambda *_: 0),
        ("firmware_runtime.links.cut.cut._check", lambda *_: None),
        ("firmware_runtime.links.cut.window.Seen.has", lambda *_: False),
        ("firmware_runtime.links.cut.window.SIZE", 64),
        ("firmware_runtime.links.cut.delivery.Step.waits", False),
        ("firmware_runtime.links.cut.delivery.Delivery._give_up", lambda *_: None),
    ],
)
def test_a_link_without_one_of_its_checks_is_found_out(
    monkeypatch: pytest.MonkeyPatch, function: str, instead: object
) -> None:
    monkeypatch.setattr(function, instead)
    assert not sweep(LinkTarget(1), 1_500).is_clean


@pytest.mark.slow
def test_without_a_key_nothing_that_is_broken_crashes_or_enters_as_no_number() -> None:
    """On loopback a link has no key: bits that are flipped get as far as the values."""
    target, random = LinkTarget(1), Random(1)  # noqa: S311 -- to be repeated
    target._end.carrier._key = None
    entered: list[tuple[str, object]] = []
    for attempt in target.attempts(8_000):
        plain = bytearray(attempt.datagram[:-32])
        # a flipped counter is one that all later ones are below: seldom, for most to get further
        first = HEADER if random.random() < 0.998 else 0
        if random.random() < 0.5 and len(plain) > first:
            bit = random.randrange(8 * first, 8 * len(plain))
            plain[bit // 8] ^= 1 << bit % 8
        entered += target._end.take(bytes(plain))
    assert len(entered) > 50
    for port, value in entered:
        if port == "controller:yaw":
            assert isinstance(value, int | float)
            assert -YAW_LIMIT <= value <= YAW_LIMIT
        elif port == "controller:turn":
            assert isinstance(value, str)
        else:
            assert isinstance(value, Motion)
            assert {type(part) for part in value} <= {int, float}
            assert all(map(math.isfinite, value))


class Careless(BridgeTarget):
    """Takes everything, and raises for some."""

    def judge(self, attempt: Attempt) -> str:
        if attempt.what == "noise":
            raise LookupError
        return ACCEPTED


def test_a_careless_judge_is_found_out() -> None:
    result: Result = sweep(Careless(1), 300)
    assert not result.is_clean
    assert min(len(result.crashes), result.accepted_hostile) > 0
