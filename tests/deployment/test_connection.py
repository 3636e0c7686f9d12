import shlex
from collections.abc import Sequence
from pathlib import Path

import pytest

from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment.connection import Commands, Connection, fault_of_host
from firmware_runtime.system.programs import Ended


class Recorded(Commands):
    """Runs nothing; keeps what it is asked, and ends as it was set."""

    def __init__(self, ended: Ended) -> None:
        super().__init__(print)
        self.ended = ended
        self.asked: list[Sequence[str]] = []

    def run(self, command: Sequence[str], scripts: Sequence[Path] = ()) -> Ended:
        assert all(script.is_file() for script in scripts)
        self.asked.append(command)
        return self.ended


def connected(status: int = 0, error: str = "") -> tuple[Connection, Recorded]:
    commands = Recorded(Ended(status, "", error))
    return Connection("pi@robot", ["-oPort=2222"], commands), commands


def test_the_target_takes_apart_what_was_given_as_arguments() -> None:
    connection, commands = connected()
    awkward = "it's; rm -rf $HOME"
    connection.script(["probe.sh"], "", awkward, "tachobot")
    *before, host, remote = commands.asked[0]
    assert host == "pi@robot"
    assert before[-1] == "--"
    assert shlex.split(remote) == ["sh", "-s", "--", "", awkward, "tachobot"]


def test_options_of_the_user_come_first_because_ssh_takes_the_first() -> None:
    connection, commands = connected()
    connection.command("true")
    assert commands.asked[0][:2] == ["ssh", "-oPort=2222"]
    assert "-oBatchMode=yes" in commands.asked[0]


def test_as_root_everything_goes_through_sudo_that_asks_for_nothing() -> None:
    connection, commands = connected()
    connection.become_root()
    connection.command("true")
    connection.send(Path("/parcel"), "/opt/firmware-runtime/parcel")
    assert commands.asked[0][-1] == "sudo -n true"
    assert "--rsync-path=sudo -n rsync" in commands.asked[1]
    assert commands.asked[1][-2:] == ["/parcel/", "pi@robot:/opt/firmware-runtime/parcel/"]


def test_a_failure_of_ssh_is_its_last_line() -> None:
    connection, _ = connected(255, "@@@@\nHost key verification failed.\r\n")
    with pytest.raises(DeploymentError, match=r"^pi@robot: Host key verification failed\.$"):
        connection.command("true")


def test_a_connection_that_breaks_off_without_a_word_is_called_that() -> None:
    connection, _ = connected(255)
    with pytest.raises(DeploymentError) as failed:
        connection.command("true")
    assert (failed.value.where, failed.value.what) == ("pi@robot", "the connection broke off")


def test_a_failure_of_the_remote_command_is_its_status() -> None:
    connection, _ = connected(8, "it hurts")
    assert connection.command("true").status == 8


@pytest.mark.parametrize(
    ("error", "said"),
    [
        ("ssh: lost\nrsync: connection unexpectedly closed\nrsync error: code 255", "ssh: lost"),
        ("rsync: write failed: No space left\nrsync error: code 11", "rsync: write failed: No"),
        ("", "said nothing"),
    ],
)
def test_a_failure_of_rsync_is_what_ssh_said_or_rsync_first(error: str, said: str) -> None:
    connection, _ = connected(12, error)
    with pytest.raises(DeploymentError, match=said):
        connection.send(Path("/parcel"), "/there")


@pytest.mark.parametrize("host", ["robot", "pi@robot", "pi@192.168.1.7", "my-robot.local"])
def test_a_name_with_or_without_a_user_is_a_host(host: str) -> None:
    assert fault_of_host(host) is None
