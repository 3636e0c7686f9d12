"""`bench peers`: what is made of activations, and every engine's real run."""

from importlib.util import find_spec

import pytest

from benchmarks import peers
from benchmarks.peers import quiet_figures, stall_figures
from firmware_runtime.cli.main import main

PERIOD = 10_000_000


def answer(*offsets: int, numbers: range | None = None) -> dict[str, object]:
    counted = numbers or range(1, len(offsets) + 1)
    fired = [
        (number, 7_000 + number * PERIOD + offset)
        for number, offset in zip(counted, offsets, strict=True)
    ]
    return {"fired": fired, "cpu_s": 0.1, "told": "nothing"}


def test_a_constant_offset_is_no_lateness() -> None:
    figures = quiet_figures(answer(*[50_000] * 99, 150_000), PERIOD)
    assert (figures["p50_us"], figures["max_us"]) == (0, 100)
    assert figures["drift_ppm"] == 0


def test_drift_is_how_fast_the_schedule_is_left_behind() -> None:
    figures = quiet_figures(answer(*[-700 * number for number in range(1, 101)]), PERIOD)
    assert figures["drift_ppm"] == pytest.approx(-70, rel=0.02)


def test_late_events_after_a_stall_are_counted_until_one_is_on_time() -> None:
    behind = [500_000_000 - n * PERIOD for n in range(1, 50)]
    figures = stall_figures(answer(*[0] * 10, *behind, 0, 0), PERIOD, 10)
    assert figures["late_events"] == 49
    assert figures["in_phase_after_ms"] == 0


def test_skipped_periods_leave_no_late_event() -> None:
    fired = [(number, number * PERIOD) for number in (*range(1, 11), *range(61, 71))]
    figures = stall_figures({"fired": fired, "told": "50 skipped"}, PERIOD, 10)
    assert figures["late_events"] == 0
    assert figures["in_phase_after_ms"] == 10


@pytest.mark.slow
@pytest.mark.parametrize("engine", peers.MODULES)
def test_every_engine_fires_every_period(engine: str) -> None:
    module = peers.MODULES[engine]
    if module is not None and find_spec(module) is None:
        pytest.skip(f"needs {module}, of the extra `bench`")
    asked = {"period_ns": 5_000_000, "periods": 20, "stall_at": 5, "stall_ns": 0}
    numbers = [number for number, _ in peers._run(engine, asked)["fired"]]
    assert numbers == sorted(set(numbers))
    assert numbers[-1] in {19, 20}


def test_without_the_peer_one_sentence_names_the_extra(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(peers, "find_spec", lambda _name: None)
    assert main(["bench", "peers"]) == 2
    assert "extra `bench`" in capsys.readouterr().err
