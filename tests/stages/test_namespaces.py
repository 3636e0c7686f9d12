"""A bad network on this machine is what the kernel allows, and nothing of it is left."""

import os
import subprocess
from pathlib import Path

import pytest

from firmware_runtime.lab.stages import namespaces
from firmware_runtime.lab.stages.namespaces import Namespaces, netem, remove_leftovers
from firmware_runtime.lab.stages.way import bad_network
from firmware_runtime.links.cut.impaired_path import Impairment
from firmware_runtime.system.programs import ProgramFailed
from firmware_runtime.system.this_process import ProcessIdentity, boot_id, this_process

HOW = Impairment(delay=5_000_000, jitter=1_000_000, loss=0.02, duplicate=0.01, seed=5)


def ours() -> list[str]:
    """Namespaces of this process."""
    return [name for name in namespaces._names() if f"-{os.getpid()}-" in name]


@pytest.mark.slow
def test_a_bad_network_is_there_in_its_block_and_gone_after_it() -> None:
    said: list[str] = []
    with bad_network(HOW, said.append) as way:
        impaired = way.conditions["impairment"]
        assert impaired["how"] == str(HOW)
        assert impaired["by"] in {"tc netem", "a process"}
        are_there = way.conditions["between"] == "two network namespaces"
        assert len(ours()) == 2 * are_there
        assert bool(way.before_robot) == are_there
        assert are_there or "no network namespaces here" in said[-1]
        key = Path(way.robot_link.rpartition("key=")[2])
        assert key.stat().st_mode & 0o777 == 0o600
    assert ours() == []
    assert not key.exists()


def test_a_step_that_fails_leaves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    real = namespaces._run
    done: list[tuple[str, ...]] = []

    def run(*command: str) -> str:
        done.append(command)
        if command[:3] == ("ip", "link", "add"):
            raise ProgramFailed("ip link add: no such kind of link")
        return "" if "netns" not in command[:2] else real("true")

    monkeypatch.setattr(namespaces, "_run", run)
    with pytest.raises(ProgramFailed), namespaces.made():
        pass
    deleted = [command[-1] for command in done if command[:3] == ("ip", "netns", "delete")]
    added = [command[-1] for command in done if command[:3] == ("ip", "netns", "add")]
    assert deleted == added
    assert len(added) == 2


def names_of(identity: ProcessIdentity) -> str:
    return f"fr-{identity.pid}-{identity.started_ticks}-c"


def test_only_those_of_dead_owners_are_leftovers(monkeypatch: pytest.MonkeyPatch) -> None:
    here = this_process()
    dead = ProcessIdentity(here.pid, (here.started_ticks or 0) + 1, boot_id())
    there = [names_of(here), names_of(dead), "fr-x-y-c", "another", "fr-1"]
    deleted: list[str] = []
    monkeypatch.setattr(namespaces, "_names", lambda: there)
    monkeypatch.setattr(namespaces, "_delete", deleted.append)
    assert remove_leftovers() == deleted == [names_of(dead)]


def test_the_words_of_netem() -> None:
    words = "delay 5000us 1000us loss 2% duplicate 1% limit 10000"
    assert " ".join(netem(HOW)) == words


@pytest.mark.parametrize(
    ("euid", "found", "why"), [(1000, "/sbin", "root"), (0, None, "no ip"), (0, "/sbin", None)]
)
def test_what_speaks_against_namespaces_is_said(
    monkeypatch: pytest.MonkeyPatch, euid: int, found: str | None, why: str | None
) -> None:
    monkeypatch.setattr(namespaces, "geteuid", lambda: euid)
    monkeypatch.setattr(namespaces, "which", lambda _tool: found)
    said = namespaces.why_not()
    assert said is None if why is None else why in (said or "")


@pytest.mark.slow
def test_a_command_that_hangs_or_is_missing_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    for command, why in ((("no-such-command",), "no-such-command"), (("false",), "status 1")):
        with pytest.raises(ProgramFailed, match=why):
            namespaces._run(*command)
    monkeypatch.setattr(namespaces, "_TIMEOUT_S", 0.05)
    with pytest.raises(ProgramFailed, match=r"no end after 0\.05 s"):
        namespaces._run("sleep", "5")


def test_a_pair_has_names_of_its_own() -> None:
    pair = Namespaces()
    assert pair.controller != pair.robot
    assert len(pair.controller.encode()) < 100
    assert subprocess.list2cmdline(namespaces.inside(pair.robot)).endswith(pair.robot)
