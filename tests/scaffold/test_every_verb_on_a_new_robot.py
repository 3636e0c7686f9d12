"""Every verb on a robot that `new` wrote, and on a second one of its kind, each as its own process.

What its page says is run by test_robot_of_your_own_page.py, a deployment by tests/deployment.
"""

from pathlib import Path

import pytest

from firmware_runtime.board.local_settings import PLACE
from firmware_runtime.errors import Status
from firmware_runtime.host.scaffold.package import write_robot
from tests.support.completion import asked_for
from tests.support.written_package import WrittenPackage, as_installed

pytestmark = pytest.mark.slow
SOCKET = "doubles.socket"


@pytest.fixture
def rover(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> WrittenPackage:
    """A new robot; the settings of another one of its kind, `left`, are in force here."""
    write_robot("rover", tmp_path / "rover")
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    monkeypatch.setenv(PLACE, str(tmp_path / "settings"))
    (tmp_path / "settings").mkdir()
    shipped = (tmp_path / "rover/rover/board.toml").read_text()
    (tmp_path / "settings/left.toml").write_text(f'name = "left"\n{shipped}')
    return as_installed(tmp_path / "rover", tmp_path / "site")


@pytest.mark.parametrize("name", ["rover", "left"])
def test_it_runs_on_served_doubles_under_its_own_name(
    rover: WrittenPackage, name: str, tmp_path: Path
) -> None:
    with rover.running("doubles", "serve", name, "--socket", SOCKET, until=f"serving {name}"):
        ran = rover.command("run", name, "--doubles", SOCKET, "--for", "1")
        assert ran.returncode == Status.OK, ran.stderr
        assert "the head follows a light" in ran.stdout
        assert "all outputs off" in ran.stdout.splitlines()
        with rover.running("guard", name, "--doubles", SOCKET, until=f"{name}.stats") as guard:
            pass
        assert guard.returncode == Status.OK
        off = rover.command("safe-state", name, "--doubles", SOCKET)
        assert off.returncode == Status.OK, off.stderr
        other = {"rover": "left", "left": "rover"}[name]
        wrong = rover.command("run", other, "--doubles", SOCKET, "--for", "1")
        assert wrong.returncode == Status.BAD_INPUT
    for words in (
        ["stats", name, "--json"],
        ["top", name],
        ["report", name, "-o", "page.html"],
        ["export", name, "-o", "trace.json"],
    ):
        ended = rover.command(*words)
        assert ended.returncode == Status.OK, (words, ended.stderr)
    assert {path.name for path in tmp_path.glob("*.stats")} == {f"{name}.stats"}


def test_what_looks_at_it_knows_both_names(rover: WrittenPackage) -> None:
    listed = rover.command("show").stdout
    assert "\nrover " in listed
    assert "\nleft " in listed
    for verb, begun, name in (("run", "ro", "rover"), ("stats", "le", "left")):
        answer = rover.folder / "answer"
        shell = {**asked_for(verb, begun), "_ARGCOMPLETE_STDOUT_FILENAME": str(answer)}
        with pytest.MonkeyPatch.context() as patch:
            for variable, value in shell.items():
                patch.setenv(variable, value)
            rover.command()
        assert answer.read_text() == name
    assert "left fits" in rover.command("probe", "--doubles", "left").stdout
    for name in ("rover", "left"):
        examined = rover.command("doctor", name)
        assert examined.returncode in {Status.OK, Status.DOCTOR_WARNS, Status.DOCTOR_FAILS}
        assert "Traceback" not in examined.stderr
        asked = rover.command("arm", name)
        assert asked.returncode in {Status.BAD_INPUT, Status.NO_DEVICE}  # no run is there


def test_a_bridge_to_it_waits_for_a_run(rover: WrittenPackage) -> None:
    listen = ("--listen", "127.0.0.1:0")
    with rover.running("bridge", "left", *listen, until="waiting for one") as bridge:
        pass
    assert bridge.returncode == Status.OK


def test_what_it_cannot_do_here_is_said_in_a_sentence(rover: WrittenPackage) -> None:
    away = rover.command("deploy", "-o", "ConnectTimeout=1", "localhost.invalid", "rover")
    assert away.returncode == Status.NOT_DEPLOYED
    unknown = rover.command("deploy", "localhost.invalid", "right")
    assert unknown.returncode == Status.BAD_INPUT
    for ended in (away, unknown):
        assert "Traceback" not in ended.stderr
