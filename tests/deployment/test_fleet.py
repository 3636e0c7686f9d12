"""Fleets: their file, and what becomes of robots when one of them fails."""

import shlex
from collections.abc import Sequence
from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.errors import ConfigError, DeploymentError, FirmwareRuntimeError, Status
from firmware_runtime.host.deployment.fleet import FleetRobot, deploy_all, load_fleet

SOUND = """
[left]
host = "pi@left"
board = "tachobot"
settings = "left.toml"
port = 2222
identity = "keys/left"
ssh_options = ["ProxyJump=gate"]
python = "/opt/python/bin/python3"

[right]
host = "right"
board = "detective"
"""


def fleet(folder: Path, text: str) -> Path:
    file = folder / "fleet.toml"
    file.write_text(text)
    return file


def test_a_robot_a_table_in_their_order(tmp_path: Path) -> None:
    robots = load_fleet(fleet(tmp_path, SOUND))
    assert list(robots) == ["left", "right"]
    assert robots["left"].ssh_options == ("ProxyJump=gate",)
    assert robots["right"] == FleetRobot("right", "detective")


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("", ["no robot; expected a table for each"]),
        ("left", ["not valid TOML"]),
        ("left = 3", ["left: 3: expected a table"]),
        ("[left]", ["left.host: missing", "left.board: missing"]),
        ('[left]\nhots = "a"\nboard = "b"', ["left.hots: unknown key; did you mean host?"]),
        ('[left]\nhost = 3\nboard = "b"', ["left.host: 3: expected"]),
        ('[left]\nhost = "a"\nboard = "b"\nport = "ssh"', ["left.port: 'ssh': expected"]),
        ('[left]\nhost = "a"\nboard = "b"\nport = 0', ["left.port: 0: expected"]),
        ('[left]\nhost = "a"\nboard = "b"\nssh_options = "x"', ["left.ssh_options: 'x'"]),
        ('[left]\nhost = "a"\nboard = "b"\nssh_options = [1]', ["left.ssh_options"]),
        ('[a]\nhost = "a"\n[b]\nboard = "b"', ["a.board: missing", "b.host: missing"]),
    ],
)
def test_all_that_is_wrong_with_a_fleet_is_said_at_once(
    tmp_path: Path, text: str, faults: Sequence[str]
) -> None:
    with pytest.raises(ConfigError) as failed:
        load_fleet(fleet(tmp_path, text))
    found = [each for said in faults for each in failed.value.faults if each.startswith(said)]
    assert len(found) == len(faults), failed.value.faults


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('host = "-o"\nboard = "tachobot"', "left: '-o': no host"),
        ('host = "a"\nboard = "toaster"', "left: 'toaster': no board"),
        ('host = "a"\nboard = "x"\nsettings = "x.toml"', "x.toml: no file; expected a board.toml"),
    ],
)
def test_what_a_robot_cannot_be_deployed_by_is_refused_before_the_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, said: str
) -> None:
    file = fleet(tmp_path, f"[first]\nhost = 'a'\nboard = 'tachobot'\n[left]\n{text}\n")
    assert main(["deploy", "--all", str(file)]) == Status.BAD_INPUT
    printed = capsys.readouterr()
    assert said in printed.err
    assert printed.out == ""


GONE = DeploymentError("Connection refused", where="b")


@pytest.mark.parametrize(
    ("ends", "status", "told"),
    [
        ([0, 0, 0], 0, ["done", "done", "done"]),
        ([0, 6, 0], 6, ["done", "deployed, but no activation was seen", "not done"]),
        ([130, 0, 0], 130, ["interrupted", "not done", "not done"]),
        ([0, GONE, 0], GONE, ["done", "failed: b: Connection refused", "not done"]),
    ],
)
def test_the_first_that_fails_ends_it_and_a_table_says_what_was_done(
    ends: Sequence[int | FirmwareRuntimeError],
    status: int | FirmwareRuntimeError,
    told: Sequence[str],
) -> None:
    asked: list[str] = []
    printed: list[str] = []
    outcomes = dict(zip("abc", ends, strict=True))

    def deploy(robot: str) -> int:
        asked.append(robot)
        ended = outcomes[robot]
        if isinstance(ended, FirmwareRuntimeError):
            raise ended
        return ended

    robots = {name: name for name in "abc"}
    if isinstance(status, FirmwareRuntimeError):
        with pytest.raises(type(status)):
            deploy_all(robots, deploy, printed.append)
    else:
        assert deploy_all(robots, deploy, printed.append) == status
    table = [line.partition("  ") for line in printed[-3:]]
    assert [(name, outcome) for name, _, outcome in table] == list(zip("abc", told, strict=True))
    assert asked == [
        name for name, outcome in zip("abc", told, strict=True) if outcome != "not done"
    ]


def test_a_host_that_does_not_answer_ends_a_fleet_with_its_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = "host = '{}.invalid'\nboard = 'tachobot'\n"
    text = "".join(f"[{name}]\n{table.format(name)}" for name in ("left", "right"))
    words = shlex.split(f"deploy --all {fleet(tmp_path, text)} --dry-run --force")
    assert main(words) == Status.NOT_DEPLOYED
    printed = capsys.readouterr()
    assert printed.out.splitlines()[-2].startswith("left   failed: left.invalid: ssh: ")
    assert printed.out.splitlines()[-1] == "right  not done"
    assert "left.invalid: ssh: Could not resolve hostname" in printed.err
