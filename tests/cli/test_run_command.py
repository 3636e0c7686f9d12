import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.models.pid import Pid
from tests.support.second_choice_board import second_choice_board
from tests.support.waiting import wait_until

VIRTUAL = ("run", "tachobot", "--doubles", "--clock", "virtual")
PERCENTILES = {"p50", "p90", "p99", "p999", "max", "mean"}
TRACED = {
    "world.yaw_rad",
    "world.yaw_rate_rad_s",
    "controller.yaw.command_n",
    "thrust_pairs.duties",
}


def lines_of(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


@pytest.mark.slow
def test_a_run_ends_settled_at_one_radian(command: Callable[..., Any]) -> None:
    ended = command(*VIRTUAL, "--json")
    document = json.loads(ended.out)
    assert (ended.status, ended.error) == (0, "")
    assert (document["board"], document["clock"]) == ("tachobot", "virtual")
    assert document["result"]["settled"] is True
    assert document["result"]["yaw_rad"] == pytest.approx(1.0, abs=0.02)
    assert document["result"]["yaw_error_rad"] == 1.0 - document["result"]["yaw_rad"]
    assert document["outputs_on"] == {"thrust_pairs": 0}


@pytest.mark.slow
def test_a_result_is_judged_by_the_reference_that_was_sent(command: Callable[..., Any]) -> None:
    sent = ("--for", 20, "--input", "8:yaw_reference=0.5")
    result = json.loads(command(*VIRTUAL, *sent, "--json").out)["result"]
    assert result["yaw_rad"] == pytest.approx(0.5, abs=0.02)
    assert (result["yaw_reference_rad"], result["settled"]) == (0.5, True)


def test_the_statistics_have_the_keys_others_rely_on(command: Callable[..., Any]) -> None:
    statistics = json.loads(command(*VIRTUAL, "--for", 1, "--json").out)["statistics"]
    assert statistics["schema"] == 1
    assert statistics["scheduled"] == statistics["run"] + statistics["skipped"]
    assert statistics["models"]["imu"]["scheduled"] == 101
    assert {"skipped", "coalesced", "overruns", "episodes", "worst"} <= set(statistics)
    assert statistics["deadline_misses"] == {"imu.sample -> thrust_pairs": 0}
    assert set(statistics["lateness_us"]) == set(statistics["step_us"]) == PERCENTILES
    assert {"imu", "thrust_pairs"} <= set(statistics["models"])
    assert set(statistics["models"]["imu"]["lateness_us"]) == PERCENTILES
    assert set(statistics["bus"]["i2c1"]) == {
        "transactions",
        "bytes",
        "errors",
        "retries",
        "utilisation",
    }
    assert {"kernel", "python", "board_sha256", "settings", "run"} <= set(statistics["conditions"])


@pytest.mark.slow
def test_the_statistics_have_the_serial_ports_of_a_robot_with_any(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    board = second_choice_board(tmp_path)
    ended = command("run", board, "--doubles", "--clock", "virtual", "--for", 2, "--json")
    ports = json.loads(ended.out)["statistics"]["serial"]
    assert ports["treads"]["writes"] > 0
    assert ports["sonar"]["bytes_read"] > 0


@pytest.mark.slow
def test_text_shows_the_step_and_the_statistics(command: Callable[..., Any]) -> None:
    ended = command(*VIRTUAL)
    assert ended.status == 0
    for part in ("world.yaw_rad", "█", "settled True", "activations run, 0 skipped", "bus i2c1:"):
        assert part in ended.out


def test_a_trace_has_the_plants_truth_at_every_tick(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    path = tmp_path / "trace.jsonl"
    assert command(*VIRTUAL, "--for", 2, "--trace", path).status == 0
    by_port: dict[str, list[int]] = {}
    for line in lines_of(path):
        assert set(line) == {"t_ns", "port", "value"}
        by_port.setdefault(line["port"], []).append(line["t_ns"])
    ticks = by_port["imu.sample"]
    assert len(ticks) > 100
    assert all(by_port[port] == ticks for port in TRACED)


def test_the_same_seed_gives_identical_bytes(command: Callable[..., Any], tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("first", "second", "other")]
    for path, seed in zip(paths, (1, 1, 2), strict=True):
        command(*VIRTUAL, "--for", 2, "--trace", path, "--set", f"world.seed={seed}")
    first, second, other = (path.read_bytes() for path in paths)
    assert first == second
    assert first != other


@pytest.mark.slow
@pytest.mark.real_time
def test_a_real_time_run_on_time_gives_the_virtual_runs_trace(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    """The tolerance is nearly a period; a machine that is later ends the run."""
    overruns = {"tolerance_us": 9000, "policy": "stop", "stop_after_us": 9000}
    overrides = [f"--set=overruns.imu.{name}={value}" for name, value in overruns.items()]
    virtual, real = tmp_path / "virtual", tmp_path / "real"
    command(*VIRTUAL, "--for", 1, *overrides, "--trace", virtual)

    def is_whole() -> bool:
        command("run", "tachobot", "--doubles", "--for", 1, *overrides, "--trace", real)
        assert virtual.read_bytes().startswith(real.read_bytes())
        return real.read_bytes() == virtual.read_bytes()

    wait_until(is_whole, "a second in which the machine is never late by 9 ms")


@pytest.mark.slow
def test_scaled_time_gives_the_same_result_sooner(command: Callable[..., Any]) -> None:
    scaled = command(
        "run", "tachobot", "--doubles", "--clock", "scaled", "--speed", 4, "--for", 4, "--json"
    )
    document = json.loads(scaled.out)
    assert scaled.status == 0
    assert document["clock"] == "scaled"
    assert document["result"]["yaw_rad"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_a_setting_reaches_the_plant(command: Callable[..., Any]) -> None:
    ended = command(*VIRTUAL, "--json", "--set", "controller.yaw.reference_rad=-0.5")
    assert json.loads(ended.out)["result"]["yaw_rad"] == pytest.approx(-0.5, abs=0.02)


def test_an_exception_in_a_model_ends_with_outputs_off_and_statistics_kept(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    calls = iter(range(1000))

    def fail_after_a_second(pid: Pid, *_arguments: object) -> float:
        if next(calls) < 100:
            return 0.1
        raise ZeroDivisionError(f"{pid.name} went wrong")

    monkeypatch.setattr(Pid, "_answer", fail_after_a_second)
    path = tmp_path / "kept.stats"
    ended = command(*VIRTUAL, "--json", "--statistics", path)
    document = json.loads(ended.out)
    assert ended.status == 1
    assert "tachobot.controller.yaw at 1." in ended.error
    assert "yaw went wrong" in ended.error
    assert document["outputs_on"] == {"thrust_pairs": 0}
    assert document["ended"]["state"] == "failed"
    kept = json.loads(command("stats", "--statistics", path, "--json").out)
    assert kept == {**document["statistics"], "takeovers": []}
    assert kept["conditions"]["run"]["state"] == "failed"
