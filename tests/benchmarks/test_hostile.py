"""Hostile datagrams, fewer than the bench sends: every one is judged as the document says."""

from collections.abc import Callable

import pytest

from benchmarks.hostile.bridge import BridgeTarget
from benchmarks.hostile.link import LinkTarget
from benchmarks.hostile.sweep import ACCEPTED, Attempt, Result, Target, result_text, sweep
from firmware_runtime.cli.main import main

TARGETS: list[Callable[[int], Target]] = [BridgeTarget, LinkTarget]


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("seed", [1, 2])
def test_every_datagram_is_judged_as_the_document_says(
    target: Callable[[int], Target], seed: int
) -> None:
    result = sweep(target(seed), 10_000)
    assert result.is_clean, result_text("sweep", result)
    assert result.verdicts[ACCEPTED] > 1_000
    assert len(result.verdicts) > 8


@pytest.mark.slow
@pytest.mark.parametrize(
    ("function", "instead"),
    [
        ("firmware_runtime.links.udp.opened", lambda datagram, _key: datagram[:-32]),
        ("firmware_runtime.links.window.Window.judge", lambda *_: None),
        ("firmware_runtime.links.peer_clock.PeerClock.age", lambda *_: 0),
        ("firmware_runtime.links.packed._check", lambda *_: None),
    ],
)
def test_a_link_without_one_of_its_checks_is_found_out(
    monkeypatch: pytest.MonkeyPatch, function: str, instead: Callable[..., object]
) -> None:
    monkeypatch.setattr(function, instead)
    assert not sweep(LinkTarget(1), 3_000).is_clean


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


@pytest.mark.slow
def test_the_bench_prints_what_it_found(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "hostile", "--datagrams", "2000"]) == 0
    printed = capsys.readouterr().out
    assert "bridge with a key: 2000 datagrams" in printed
    assert "link over UDP with a key: 2000 datagrams" in printed
    clean = "crashes 0, values accepted that should not be 0, verdicts that differ 0"
    assert printed.count(clean) == 2
