"""Parts of a deployment: the connection, the target's faults, packages and names."""

import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import distribution
from pathlib import Path
from zipfile import ZipFile

import pytest

from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment.connection import Commands, Connection, fault_of_host
from firmware_runtime.host.deployment.package_wheel import with_local_dependencies
from firmware_runtime.host.deployment.target import ROOM_KIB, Platform, Target
from firmware_runtime.host.deployment.update import update_of
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
    connection.send(Path("/content"), "/opt/firmware-runtime/venv.aaaaaa")
    assert commands.asked[0][-1] == "sudo -n true"
    assert "--rsync-path=sudo -n rsync" in commands.asked[1]
    assert commands.asked[1][-2:] == ["/content/", "pi@robot:/opt/firmware-runtime/venv.aaaaaa/"]


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
        connection.send(Path("/content"), "/there")


@pytest.mark.parametrize("host", ["robot", "pi@robot", "pi@192.168.1.7", "my-robot.local"])
def test_a_name_with_or_without_a_user_is_a_host(host: str) -> None:
    assert fault_of_host(host) is None


RASPBERRY_PI = """\
machine aarch64
python 3.11.2
bits 64
base /usr/bin/python3.11
magic a70d0d0a
packages six==1.16.0
board tachobot
glibc 2.36
rsync /usr/bin/rsync
free_kib 25269534
superuser sudo
writable
systemd yes
foreign
settings /etc/firmware-runtime/tachobot.toml
lacking
"""


@pytest.fixture
def pi() -> Target:
    return Target.read(RASPBERRY_PI)


def test_a_target_that_has_everything_has_no_faults(pi: Target) -> None:
    assert pi.faults("python3", "") == []
    assert pi.platform == Platform("aarch64", (3, 11))
    assert pi.text() == "aarch64, Python 3.11.2, glibc 2.36, 24.1 GiB free, root by sudo"
    assert pi.settings == "/etc/firmware-runtime/tachobot.toml"


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("machine", "armv7l", "processor armv7l; expected one of aarch64, x86_64"),
        (
            "python",
            "",
            "python3: not found; expected Python 3.11 or later (Debian package python3)",
        ),
        (
            "python",
            "3.9.2",
            "python3 is 3.9.2; expected 3.11 or later; --python PATH names another",
        ),
        ("python", "2.7.18", "python3 is 2.7.18; expected 3.11 or later"),
        ("bits", "32", "python3 is a 32-bit program; expected a 64-bit system"),
        ("magic", "", "python3 is not whole; install Debian package python3"),
        ("glibc", "2.27", "glibc: 2.27; expected 2.28 or newer"),
        ("glibc", "", "glibc: none; expected 2.28 or newer"),
        ("rsync", "", "rsync: not found; install Debian package rsync"),
        ("free_kib", str(ROOM_KIB - 1), "499 MiB free for /opt/firmware-runtime; expected 500"),
        ("superuser", "", "neither root nor sudo without a password"),
        ("systemd", "", "systemd does not run it"),
        ("armed", "left", "left is armed, expected it disarmed: firmware-runtime disarm left"),
        ("lacking", "/dev/i2c-1", "/dev/i2c-1: not there; expected the board's device"),
        ("foreign", "/opt/firmware-runtime/venv", "no link that a deployment made"),
    ],
)
def test_what_is_missing_is_said_in_one_sentence(
    pi: Target, key: str, value: str, said: str
) -> None:
    faults = replace(pi, **{key: value}).faults("python3", "")
    assert len(faults) == 1
    assert said in faults[0]


def test_below_a_root_neither_systemd_nor_a_superuser_is_needed(pi: Target) -> None:
    plain = replace(pi, superuser="", systemd="", writable="yes")
    assert plain.faults("python3", "/home/pi/trial") == []
    assert replace(plain, writable="").faults("python3", "/srv") == [
        "/srv: this user may not write there"
    ]


PURE, COMPILED = "py3-none-any", "cp311-cp311-linux_x86_64"


class Site:
    """A folder with packages as pip leaves them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def install(
        self, name: str, *requires: str, tag: str = PURE, is_from_index: bool = False
    ) -> None:
        metadata = self.folder / f"{name}-1.0.dist-info"
        metadata.mkdir()
        needs = "".join(f"Requires-Dist: {each}\n" for each in requires)
        (metadata / "METADATA").write_text(f"Name: {name}\nVersion: 1.0\n{needs}")
        (metadata / "WHEEL").write_text(f"Wheel-Version: 1.0\nTag: {tag}\n")
        if not is_from_index:
            (metadata / "direct_url.json").write_text('{"url": "file:///x", "dir_info": {}}')


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Site:
    monkeypatch.syspath_prepend(str(tmp_path))
    return Site(tmp_path)


def names() -> list[str]:
    return [each.name for each in with_local_dependencies([distribution("heron_robot")])]


def test_what_was_installed_from_a_folder_comes_along_and_what_that_needs(site: Site) -> None:
    site.install("heron_robot", "firmware_runtime", "heron_chip>=1", "heron_index[x]")
    site.install("heron_chip", "heron_bus ; python_version > '3'", "heron_robot")
    site.install("heron_bus")
    site.install("heron_index", "heron_unseen", is_from_index=True)
    site.install("heron_unseen")
    assert names() == ["heron_robot", "heron_chip", "heron_bus"]


def test_extras_what_is_not_here_and_what_is_compiled_are_left_to_the_index(site: Site) -> None:
    needs = ('heron_test; extra == "test"', "heron_absent", "heron_compiled")
    site.install("heron_robot", *needs)
    site.install("heron_test")
    site.install("heron_compiled", tag=COMPILED)
    assert names() == ["heron_robot"]


SAID = """
import drivers.arm
import boards.arm
from firmware_boards.tachobot.definition import BOARD
from firmware_drivers.imu import Imu

print(drivers.arm.NAME, boards.arm.NAME, Imu.__name__, type(BOARD).__name__)
"""


@pytest.mark.slow
@pytest.mark.parametrize("files", [("arm.py", "__init__.py"), ("arm.py",)])
@pytest.mark.parametrize("order", [("site", "project"), ("project", "site")])
def test_folders_of_these_names_are_the_projects_own(
    tmp_path: Path, wheel: Path, files: Sequence[str], order: Sequence[str]
) -> None:
    site, project = tmp_path / "site", tmp_path / "project"
    with ZipFile(wheel) as archive:
        archive.extractall(site)
    for folder in ("drivers", "boards"):
        (project / folder).mkdir(parents=True)
        for file in files:
            (project / folder / file).write_text(f"NAME = 'own {folder}'\n")
    path = [str(tmp_path / each) for each in order]
    program = f"import sys; sys.path[:0] = {path}{SAID}"
    done = subprocess.run(
        [sys.executable, "-P", "-c", program], capture_output=True, text=True, check=False
    )
    assert done.stdout.split("\n")[0] == "own drivers own boards Imu BoardDefinition", done.stderr


@pytest.mark.slow
def test_the_wheel_has_four_names_at_its_top(wheel: Path) -> None:
    with ZipFile(wheel) as archive:
        tops = {name.partition("/")[0] for name in archive.namelist()}
    packages = {each for each in tops if not each.endswith(".dist-info")}
    assert packages == {"firmware_runtime", "firmware_drivers", "firmware_boards", "sim_doubles"}


def test_how_an_update_stands_is_read_from_what_the_target_prints() -> None:
    printed = (
        "version 0.2.0 venv.aaaaaa 2026-11-26T09:00:00Z in-use\nstate reverted\nboard tachobot\n"
        "since 2026-11-26T10:00:00Z\nreason imu: 100 times NoAcknowledge\n"
    )
    commands = Recorded(Ended(0, printed, ""))
    update = update_of(Connection("pi@robot", (), commands))
    assert (update.state, update.versions[0].version) == ("reverted", "0.2.0")
    assert update.lines() == [
        "0.2.0        venv.aaaaaa  2026-11-26T09:00:00Z  in use",
        "last update  reverted 2026-11-26T10:00:00Z tachobot",
        "because      imu: 100 times NoAcknowledge",
    ]


def test_a_target_that_was_never_deployed_to_has_no_update() -> None:
    connection, _ = connected(2, "sh: 0: cannot open /opt/firmware-runtime/update.sh")
    with pytest.raises(DeploymentError) as failed:
        update_of(connection)
    assert failed.value.expected == "a deployment before"
