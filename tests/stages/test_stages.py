"""Both boards in every stage by one command each, as processes; whatever ends one ends all."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import monotonic_ns
from typing import Any

import pytest

from firmware_runtime.board.registry import load
from firmware_runtime.board.roles import Stage
from firmware_runtime.devs.time import SECOND
from firmware_runtime.lab.stages import namespaces
from firmware_runtime.lab.stages.staged_run import Staged, run_staged
from firmware_runtime.statistics.paths import Companion, default_path
from firmware_runtime.system.this_process import NoteOfBoot, boot_id, leave_note
from tests.support.virtual_detective import NEAR
from tests.support.waiting import PATIENCE_S, wait_until

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")
QUICK = "delay=5ms,jitter=2ms,loss=2%,seed=1"

pytestmark = [pytest.mark.slow, pytest.mark.real_time]


@contextmanager
def started(folder: Path, *words: str) -> Iterator["subprocess.Popen[str]"]:
    """A command with places of its own, killed at the end if it is still there."""
    environment = {**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(folder)}
    with ExitStack() as stack:
        process = stack.enter_context(
            subprocess.Popen(
                [*COMMAND, *words],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        stack.callback(process.kill)
        yield process


def ended(process: "subprocess.Popen[str]") -> tuple[int, dict[str, Any], str]:
    out, error = process.communicate(timeout=2 * PATIENCE_S)
    return process.returncode, json.loads(out) if out else {}, error


def run(folder: Path, *words: str) -> dict[str, Any]:
    """The document of a run that ends well."""
    with started(folder, "run", *words, "--json") as process:
        status, document, error = ended(process)
    assert status == 0, error
    return document


def check(document: dict[str, Any], stage: str) -> None:
    """What holds of every stage."""
    assert document["stage"] == stage
    assert not any(document["outputs_on"].values())
    assert {"controller", "robot", "link", "result"} <= document.keys()
    counted = document["statistics"]
    assert counted["run"] > 0
    assert counted["scheduled"] == counted["run"] + counted["skipped"] + counted["coalesced"]


def run_of_tachobot(folder: Path, stage: str, *words: str) -> dict[str, Any]:
    """The document of a run that turns to its reference in this stage."""
    document = run(folder, "tachobot", "--stage", stage, *words, "--for", "6")
    check(document, stage)
    assert abs(document["result"]["yaw_error_rad"]) < 0.1
    return document


@pytest.mark.parametrize(("stage", "words"), [("simulation", ()), ("embedded", ("--doubles",))])
def test_tachobot_turns_to_its_reference_in_one_process(
    tmp_path: Path, stage: str, words: tuple[str, ...]
) -> None:
    run_of_tachobot(tmp_path, stage, *words)


def test_over_a_network_it_turns_and_a_trace_has_the_messages_of_both_ends_in_order_of_origin(
    tmp_path: Path,
) -> None:
    trace = tmp_path / "trace.jsonl"
    run_of_tachobot(tmp_path, "network", "--trace", str(trace))
    messages = [json.loads(line) for line in trace.read_text().splitlines()]
    instants = [message["t_ns"] for message in messages]
    assert instants == sorted(instants)
    ends = {message["port"]: message["end"] for message in messages}
    assert ends["imu.sample"] == ends["world.yaw_rad"] == "robot"
    assert ends["controller.allocation.forces"] == "controller"


def test_over_a_bad_network_it_turns_and_what_is_between_the_ends_is_in_the_result(
    tmp_path: Path,
) -> None:
    link = run_of_tachobot(tmp_path, "remote", "--impair", QUICK)["link"]
    assert link["over"] == "udp"
    assert link["impairment"]["how"] == QUICK
    if link["impairment"]["by"] == "a process":
        out = link["datagrams"]["out"]
        assert out["received"] > out["lost"] > 0
    assert namespaces.remove_leftovers() == []


AVOIDING = ("--set", "mission.avoid_obstacles=true", "--set", "world.target=[0.0, 0.85]")
"""The radar tells what is near from what is an obstacle, over the link where there is one."""


@pytest.mark.parametrize(
    ("stage", "words"),
    [
        ("simulation", ()),
        ("embedded", ("--doubles", *NEAR)),
        ("network", AVOIDING),
        ("remote", ("--impair", QUICK, *AVOIDING)),
    ],
)
def test_the_detective_finds_its_target_in_every_stage(
    tmp_path: Path, stage: str, words: tuple[str, ...]
) -> None:
    document = run(tmp_path, "detective", "--stage", stage, *words)
    check(document, stage)
    assert document["result"]["found"] is True
    assert document["ended"]["reason"] == "the target was reached"


@pytest.mark.parametrize("robot", ["balancing", "pan_tilt"])
def test_a_robot_of_another_package_has_the_stages_too_and_ends_with_its_controller(
    tmp_path: Path, robot: str
) -> None:
    board = str(Path(__file__).parents[2] / f"examples/{robot}/{robot}/board.toml")
    document = run(tmp_path, board, "--stage", "network", "--for", "3")
    check(document, "network")
    assert document["ended"]["by"] == "controller"
    for end in ("controller", "robot"):
        assert document[end]["status"] == 0
        assert document[end]["ended"]["reason"] == "the run reached 3.000000000 s"


def test_a_controller_that_is_enabled_by_the_other_end_commands_then(tmp_path: Path) -> None:
    free = ("--set", "controller.mode=free", "--set", "esc.arming_s=0.5")
    document = run(tmp_path, "tachobot", "--stage", "network", *free, "--for", "6")
    check(document, "network")
    assert document["link"]["back"]["received"] > 0
    assert document["link"]["out"]["received"] > 0


def test_a_safe_state_while_a_stage_starts_its_ends_keeps_them_disarmed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    now = monotonic_ns()  # both ends start later
    note = Companion.SAFE_STATE.beside(default_path("tachobot"))
    leave_note(note, NoteOfBoot(boot_id=boot_id(), at_ns=now - SECOND), 0o644)
    staged = Staged(
        board=load("tachobot"),
        named="tachobot",
        stage=Stage.NETWORK,
        for_s=1.0,
        called_at=now - 2 * SECOND,
    )
    said: list[str] = []
    result = run_staged(staged, said.append, lambda _: None)
    assert result.status == 0, said
    assert any("robot: stays disarmed" in sentence for sentence in said), said
    assert result.document["link"]["out"]["received"] > 0


# How it ends --------------------------------------------------------------------------------------


def children_of(process: "subprocess.Popen[str]") -> dict[str, int]:
    """The pids of the ends, by role."""
    listed = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    found = {}
    for pid in listed:
        words = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
        if "--role" in words:
            found[words[words.index("--role") + 1]] = int(pid)
    return found


def both_up(process: "subprocess.Popen[str]", folder: Path) -> dict[str, int]:
    """The ends once both keep statistics."""
    names = ("tachobot.stats", "tachobot.controller.stats")

    def are_there() -> bool:
        assert process.poll() is None, process.communicate()
        return all((folder / name).exists() for name in names)

    wait_until(are_there, "both ends run")
    return children_of(process)


LONG = ("run", "tachobot", "--stage", "network", "--for", "600", "--json")


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_both_ends(tmp_path: Path, number: signal.Signals, status: int) -> None:
    with started(tmp_path, *LONG) as process:
        pids = both_up(process, tmp_path)
        process.send_signal(number)
        found, document, _ = ended(process)
    assert found == status
    assert document["ended"] == {"state": "stopped", "reason": number.name, "by": None}
    assert document["outputs_on"] == {"thrust_pairs": 0}
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids.values())


@pytest.mark.parametrize("role", ["controller", "robot"])
def test_the_death_of_one_end_ends_the_other(tmp_path: Path, role: str) -> None:
    with started(tmp_path, *LONG) as process:
        pids = both_up(process, tmp_path)
        os.kill(pids[role], signal.SIGKILL)
        found, document, error = ended(process)
    assert found == 128 + 9
    assert document["ended"]["by"] == role
    assert f"{role}: ended by SIGKILL" in error
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids.values())
    if role == "controller":
        assert document["outputs_on"] == {"thrust_pairs": 0}


def test_the_ends_end_when_the_command_is_killed(tmp_path: Path) -> None:
    with started(tmp_path, *LONG) as process:
        pids = both_up(process, tmp_path)
        process.kill()
        process.wait()
        wait_until(
            lambda: not any(Path(f"/proc/{pid}").exists() for pid in pids.values()),
            "both ends have ended",
        )


def test_an_error_in_one_end_is_the_sentence_and_the_status(tmp_path: Path) -> None:
    (tmp_path / "tachobot.controller.stats").mkdir()
    with started(tmp_path, *LONG) as process:
        status, document, error = ended(process)
    assert status == 2
    assert f"{tmp_path}/tachobot.controller.stats: " in error
    assert document["ended"]["by"] == "controller"
    assert document["outputs_on"] == {"thrust_pairs": 0}
