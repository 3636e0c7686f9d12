"""`bench peers`: what is made of activations, and every engine's real run."""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchmarks.peers import bench as peers
from benchmarks.peers import run as peers_run
from benchmarks.peers.figures import medians, quiet_figures, ratio, stall_figures
from benchmarks.peers.plan import Plan
from benchmarks.peers.text import peers_lines
from firmware_runtime.cli.main import main

PERIOD = 10_000_000
QUIET = Plan(PERIOD, 100)
STALLED = Plan(PERIOD, 100, stall_at=10, stall_ns=500_000_000)
NO_PRIORITY = 0


def answer(*fired: tuple[int, int], told: str = "nothing") -> dict[str, object]:
    """What a run prints: activations by number, each with how late it came."""
    instants = [(number, 7_000 + number * PERIOD + late) for number, late in fired]
    return {"fired": instants, "cpu_s": 0.1, "settings": {}, "told": told}


def test_a_constant_offset_is_no_lateness() -> None:
    fired = [(number, 50_000) for number in range(1, 100)]
    figures = quiet_figures(answer(*fired, (100, 150_000)), QUIET)
    assert (figures["p50_us"], figures["max_us"], figures["drift_ppm"]) == (0, 100, 0)
    assert figures["cpu"] == 0.1


def test_drift_is_how_fast_the_schedule_is_left_behind_and_a_late_activation_is_none() -> None:
    figures = quiet_figures(answer(*[(n, -700 * n) for n in range(1, 101)]), QUIET)
    assert figures["drift_ppm"] == pytest.approx(-70)
    fired = [(n, 900_000 if n > 90 and n % 2 else 0) for n in range(1, 101)]
    assert quiet_figures(answer(*fired), QUIET)["drift_ppm"] == 0


def test_late_events_after_a_stall_are_counted_until_one_is_on_time() -> None:
    before = [(n, 0) for n in range(1, 11)]
    behind = [(10 + n, 500_000_000 - n * PERIOD) for n in range(1, 50)]
    figures = stall_figures(answer(*before, *behind, (60, 0), (61, 0)), STALLED)
    assert figures["late_events"] == 49
    assert figures["in_phase_after_ms"] == 0


def test_skipped_periods_leave_no_late_event() -> None:
    fired = [(n, 0) for n in (*range(1, 11), *range(61, 71))]
    figures = stall_figures(answer(*fired, told="50 skipped"), STALLED)
    assert (figures["late_events"], figures["told"]) == (0, "50 skipped")
    assert figures["in_phase_after_ms"] == 10


def test_a_stall_whose_activation_is_skipped_comes_in_the_next(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slept: list[float] = []
    monkeypatch.setattr("benchmarks.peers.plan.sleep", slept.append)
    plan = Plan(PERIOD, 100, stall_at=10, stall_ns=500_000_000)
    for number in (8, 12, 13, 14):
        plan.fire(number)
    assert slept == [0.5]
    fired = [(n, 0) for n in (*range(1, 9), 12, *range(62, 71))]
    figures = stall_figures(answer(*fired, told="50 skipped"), STALLED)
    assert (figures["late_events"], figures["in_phase_after_ms"]) == (0, 0)


def test_who_never_comes_back_is_never_in_phase() -> None:
    fired = [(n, 0 if n <= 10 else 500_000_000) for n in range(1, 31)]
    figures = stall_figures(answer(*fired), STALLED)
    assert (figures["late_events"], figures["in_phase_after_ms"]) == (20, None)


def a_round(
    ours_us: float, theirs_us: float, after_ms: float | None
) -> dict[str, dict[str, object]]:
    rest: dict[str, object] = {
        "p50_us": 1.0,
        "max_us": 9.0,
        "drift_ppm": 0.0,
        "cpu": 0.1,
        "late_events": 3,
    }
    rest |= {"in_phase_after_ms": after_ms, "told": "nothing"}
    settings = {"timer_slack_ns": {"asked": 1, "granted": True, "reason": None}}
    return {
        peers.OURS: {**rest, "p99_us": ours_us, "settings": settings},
        peers.PEER: {**rest, "p99_us": theirs_us, "settings": settings},
    }


def test_ratios_are_taken_within_a_round_and_the_median_is_kept() -> None:
    rounds = [a_round(10, 40, 1), a_round(20, 60, 3), a_round(1, 9, 2)]
    assert ratio(rounds, peers.PEER, peers.OURS) == 4
    assert medians(rounds)[peers.OURS]["p99_us"] == 10
    assert medians(rounds)[peers.PEER]["in_phase_after_ms"] == 2


def test_the_text_lists_what_is_missing_in_one_line_and_ends_with_the_ratio() -> None:
    rounds = [a_round(10, 40, None)]
    report = {
        peers.PEER: "3.0.0",
        "not_installed": ["SimPy", "pyjevsim"],
        "rates": {"1000": medians(rounds)},
        "ratio": 4.0,
    }
    text = list(peers_lines(report))
    assert any(line.startswith("not installed: SimPy, pyjevsim") for line in text)
    assert "granted to all: timer_slack_ns" in text
    assert text[-2:] == ["", "ratio 4.0 (p99 at 1000 Hz, xdevs.py by ours, skip)"]
    assert next(line for line in text if line.startswith("xdevs.py")).endswith("3, never, nothing")


def test_without_the_peer_one_sentence_names_the_extra(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    absent = replace(peers_run.ENGINES[peers.PEER], package="absent_package")
    monkeypatch.setitem(peers_run.ENGINES, peers.PEER, absent)
    assert main(["bench", "peers"]) == 2
    assert "group bench" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("name", peers_run.ENGINES)
def test_every_engine_fires_every_period_in_order(name: str) -> None:
    if not peers_run.ENGINES[name].is_installed:
        pytest.skip(f"needs {name}, of the dependency group bench")
    found = peers.run_once(name, Plan(5_000_000, 20), NO_PRIORITY)
    numbers = [number for number, _ in found["fired"]]
    assert numbers == sorted(set(numbers))
    assert numbers[0] == 1
    assert numbers[-1] in {19, 20, 21} or len(numbers) + skipped_of(found) == 20
    instants = [instant for _, instant in found["fired"]]
    assert instants == sorted(instants)


def skipped_of(found: Mapping[str, Any]) -> int:
    """How many activations a run says that it skipped; a busy machine makes it skip the last."""
    said = re.search(r"(\d+) skipped", found["told"])
    return 0 if said is None else int(said[1])


@pytest.mark.real_time
@pytest.mark.parametrize(("name", "least"), [("ours, skip", 0), ("ours, catch-up", 38)])
def test_a_stall_is_skipped_or_caught_up_by_policy(name: str, least: int) -> None:
    plan = Plan(5_000_000, 100, stall_at=20, stall_ns=200_000_000)
    found = peers.run_once(name, plan, NO_PRIORITY)
    numbers = [number for number, _ in found["fired"]]
    overruns, skipped = int(found["told"].split()[0]), skipped_of(found)
    assert len(numbers) + skipped == 100
    assert (skipped >= 38) == (name == "ours, skip")
    assert overruns >= least


@pytest.mark.slow
def test_the_bench_keeps_what_it_prints(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if not peers_run.ENGINES[peers.PEER].is_installed:
        pytest.skip("needs xdevs.py, of the dependency group bench")
    monkeypatch.setattr(peers, "RATES", (100,))
    monkeypatch.setattr(peers, "STALL_NS", 50_000_000)
    monkeypatch.setattr(peers, "STALL_AT_S", 0.1)
    monkeypatch.setattr(peers, "STALLED_RUN_S", 0.3)
    options = ["--seconds", "0.2", "--repetitions", "1", "--json", "--save", str(tmp_path)]
    assert main(["bench", "peers", *options]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert json.loads((tmp_path / "peers.json").read_text()) == printed
    assert printed["rates"]["100"][peers.PEER]["late_events"] >= 3
