"""`record` beside a run of its own process: what is in the folder afterwards."""

import errno
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.layout import Layout
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.system import atomic_file as whole_file
from tests.support.waiting import PATIENCE_S, wait_until

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")


@pytest.mark.slow
def test_two_runs_leave_two_files_that_the_other_verbs_read(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    folder, kept = tmp_path / "kept", tmp_path / "tachobot.stats"
    words = ["recordings", "collect", "tachobot", "--into", str(folder), "--statistics", str(kept)]
    with subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, text=True) as recorder:
        assert recorder.stdout is not None
        with ExitStack() as at_failure:
            at_failure.callback(recorder.kill)
            assert "waiting for a run" in recorder.stdout.readline()
            for _ in range(2):
                run = ["run", "tachobot", "--doubles", "--for", "1", "--statistics", str(kept)]
                subprocess.run([*COMMAND, *run], check=True, capture_output=True)
                said = next(line for line in recorder.stdout if "the run is over" in line)
                assert "its statistics are kept" in said
            recorder.send_signal(signal.SIGTERM)
            assert recorder.wait(PATIENCE_S) == 0
            at_failure.pop_all()
    first, second = (folder / f"tachobot-000{number}.stats" for number in (1, 2))
    assert [imu_of(read_statistics(each).as_json())["scheduled"] for each in (first, second)] == [
        101,
        101,
    ]
    merged = command("stats", "--merge", str(first), str(second), "--json")
    assert (merged.status, imu_of(json.loads(merged.out))["scheduled"]) == (0, 202)


@pytest.mark.slow
def test_of_a_run_that_is_killed_the_recording_is_kept_and_replays(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    folder, kept = tmp_path / "kept", tmp_path / "tachobot.stats"
    words = ["recordings", "collect", "tachobot", "--into", str(folder), "--statistics", str(kept)]
    run = ["run", "tachobot", "--doubles", "--statistics", str(kept), "--for", "600"]
    with ExitStack() as at_end:
        recorder = at_end.enter_context(
            subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, text=True)
        )
        at_end.callback(recorder.kill)
        robot = at_end.enter_context(subprocess.Popen([*COMMAND, *run], stdout=subprocess.DEVNULL))
        at_end.callback(robot.kill)
        assert recorder.stdout is not None
        assert any("keeping run 1" in line for line in recorder.stdout)
        wait_until(lambda: imu_of(read_statistics(kept).as_json())["run"] > 50, "50 samples")
        robot.kill()
        said = next(line for line in recorder.stdout if "-crash-" in line)
        recorder.send_signal(signal.SIGTERM)
        assert recorder.wait(PATIENCE_S) == 0
    (crash,) = folder.glob("tachobot-0001-crash-*.recording")
    assert said.startswith(f"recorder: {crash}")
    rows = json.loads(command("recordings", "list", "--in", folder, "--json").out)
    # On a busy machine the run may have been late before: that piece is kept, too.
    found = [(row["why"], row["end"], row["whole"]) for row in rows if row["why"] != "late"]
    assert found == [
        ("crash", "killed", True),
        ("synced", "killed", True),
    ]
    for row in rows:
        replayed = command("replay", row["file"], "--json")
        assert (replayed.status, json.loads(replayed.out)["identical"]) == (0, True)


def imu_of(document: dict[str, Any]) -> dict[str, Any]:
    imu: dict[str, Any] = document["models"]["imu"]
    return imu


@pytest.mark.slow
def test_a_full_disk_is_no_bad_input_so_that_systemd_tries_again(
    command: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def replace_file(_path: Path, _content: bytes, _mode: int | None = None) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(whole_file, "replace_file", replace_file)
    kept = tmp_path / "tachobot.stats"
    StatisticsFile(Layout(), {"models": {}, "conditions": {}}, kept).close_section(0)
    folder = tmp_path / "kept"
    ended = command(
        "recordings", "collect", "tachobot", "--into", str(folder), "--statistics", str(kept)
    )
    assert ended.status == 6
    assert "No space left on device" in ended.error


@pytest.mark.parametrize(
    ("words", "what"),
    [
        ([], "--into: expected a folder"),
        (["--into", "/proc/none"], "cannot be made"),
        (["--into", "x", "--runs", "0"], "expected a whole number from 1 on"),
        (["--into", "x", "--budget", "0"], "expected a positive number"),
        (["--into", "x", "--late-us", "-1"], "expected a positive number"),
    ],
)
def test_bad_words_are_refused(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, words: list[str], what: str
) -> None:
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    ended = command("recordings", "collect", "tachobot", *words)
    assert (ended.status, ended.out) == (2, "")
    assert what in ended.error
