import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from zipfile import ZipFile

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.errors import Status
from firmware_runtime.host.scaffold.package import write_robot
from tests.deployment.conftest import DEBIANS_PYTHON
from tests.support.ssh_target import HOST, SshTarget, free_port, make_key
from tests.support.written_package import WrittenPackage, as_installed

Deploy = Callable[..., int]


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """The target's root, as far as the deployment goes."""
    place = tmp_path / "root"
    place.mkdir()
    return place


@pytest.fixture
def deploy(
    root: Path,
    wheel: Path,
    downloaded: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Deploy:
    """Deploys tachobot below the root. There is no bus there, so the doctor's word is not taken."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(downloaded))

    def run(target: SshTarget, *words: object) -> int:
        fixed = ["deploy", HOST, "tachobot", *target.words, "--root", root, "--wheel", wheel]
        return main([str(each) for each in (*fixed, "--python", DEBIANS_PYTHON, "--force", *words)])

    return run


def boards_by(program: Path) -> str:
    """What a program that was deployed says to an order."""
    done = subprocess.run([program, "show"], capture_output=True, text=True, check=True)
    return done.stdout


def files_below(folder: Path) -> int:
    return sum(path.is_file() for path in folder.rglob("*"))


def environments(root: Path) -> set[Path]:
    return set((root / "opt/firmware-runtime").glob("venv.??????"))


def that_cannot_be_started(wheel: Path, into: Path) -> Path:
    """The wheel with a program that can be installed, as it needs no other, and fails at once."""
    broken = into / wheel.name
    with ZipFile(wheel) as whole, ZipFile(broken, "w") as archive:
        for name in whole.namelist():
            text = whole.read(name)
            if name.endswith("/METADATA"):
                text = re.sub(rb"(?m)^Requires-Dist: .*\n", b"", text)
            if name == "firmware_runtime/cli/commands/check.py":
                text = b"raise SystemExit(1)"
            archive.writestr(name, text)
    return broken


def from_a_wheel(folder: Path, site: Path) -> WrittenPackage:
    """The package of a folder as a wheel would have installed it: so none is built of it."""
    package = as_installed(folder, site)
    (metadata,) = site.glob("*.dist-info")
    (metadata / "direct_url.json").unlink()
    (metadata / "WHEEL").write_text("Wheel-Version: 1.0\nTag: py3-none-any\n")
    shutil.copytree(folder / folder.name, site / folder.name)
    own = [path.relative_to(site) for path in site.rglob("*") if path.is_file()]
    (metadata / "RECORD").write_text("".join(f"{each},,\n" for each in own))
    return package


@pytest.mark.slow
def test_what_does_not_pass_leaves_no_trace(
    target: SshTarget, deploy: Deploy, root: Path, tmp_path: Path, wheel: Path
) -> None:
    assert deploy(target, "--wheel", that_cannot_be_started(wheel, tmp_path)) == Status.NOT_DEPLOYED
    assert list((root / "opt/firmware-runtime").iterdir()) == []
    assert [each.name for each in root.iterdir()] == ["opt"]


@pytest.mark.slow
def test_a_robot_of_anyones_own_brings_its_package_and_the_next_deployment_keeps_it(
    target: SshTarget, deploy: Deploy, root: Path, wheel: Path, tmp_path: Path
) -> None:
    home, program = root / "opt/firmware-runtime", root / "usr/local/bin/firmware-runtime"
    units = root / "etc/systemd/system"
    write_robot("rover", tmp_path / "rover")
    package = from_a_wheel(tmp_path / "rover", tmp_path / "site")
    fixed = [*target.words, "--root", root, "--wheel", wheel, "--python", DEBIANS_PYTHON, "--force"]
    words = [str(word) for word in fixed]
    ended = package.command("deploy", HOST, "rover", *words)
    assert ended.returncode == 0, ended.stderr
    assert "board.toml is sound" in ended.stdout
    assert "checks: " in ended.stdout
    assert "rover" in boards_by(program)
    assert (units / "firmware-runtime@.service").is_file()
    assert (units / "firmware-runtime@rover.service.d/board.conf").is_file()
    subprocess.run([program, "new", "robot", "heron", "--into", tmp_path / "heron"], check=True)
    assert files_below(tmp_path / "heron") == len(write_robot("heron", tmp_path / "again"))
    assert deploy(target) == Status.NOT_DEPLOYED  # here its package is not known

    first = (home / "venv").readlink()
    settings = root / "etc/firmware-runtime/rover.toml"
    settings.write_text(settings.read_text() + "# mine\n")
    left = tmp_path / "left.toml"
    left.write_text(f'name = "left"\n{(package.folder / "rover/board.toml").read_text()}')
    ended = package.command("deploy", HOST, "left", "--settings", left, *words)
    assert ended.returncode == 0, ended.stderr
    assert settings.read_text().endswith("# mine\n")
    assert (home / "previous").readlink() == first
    assert environments(root) == {first, (home / "venv").readlink()}
    assert len(environments(root)) == 2
    assert boards_by(home / "previous/bin/firmware-runtime") == boards_by(
        first / "bin/firmware-runtime"
    )
    assert "rover" in boards_by(program)
    assert (units / "firmware-runtime@left.service.d/board.conf").is_file()
    assert (root / "etc/firmware-runtime/left.toml").read_text() == left.read_text()


@pytest.mark.slow
def test_a_dry_run_prints_every_command_and_changes_nothing(
    target: SshTarget, deploy: Deploy, root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert deploy(target, "--dry-run") == Status.OK
    printed = capsys.readouterr().out
    for words in ("pip", "rsync", "prepare.sh", "examine.sh", "switch.sh"):
        assert words in printed
    assert list(root.iterdir()) == []


@pytest.mark.slow
def test_a_key_that_is_not_known_there_is_refused_in_a_sentence(
    target: SshTarget, deploy: Deploy, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target.identity = make_key(tmp_path / "other")
    assert deploy(target) == Status.NOT_DEPLOYED
    assert "Permission denied (publickey)" in capsys.readouterr().err


@pytest.mark.slow
def test_another_host_key_than_the_known_one_is_refused(
    target: SshTarget, deploy: Deploy, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = make_key(tmp_path / "other").with_suffix(".pub").read_text()
    (target.folder / "known_hosts").write_text(f"[{HOST}]:{target.port} {other}")
    assert deploy(target) == Status.NOT_DEPLOYED
    assert capsys.readouterr().err == f"firmware-runtime: {HOST}: Host key verification failed.\n"


@pytest.mark.slow
def test_a_host_without_ssh_is_one_sentence(
    target: SshTarget, deploy: Deploy, capsys: pytest.CaptureFixture[str]
) -> None:
    target.port = free_port()
    assert deploy(target) == Status.NOT_DEPLOYED
    assert "Connection refused" in capsys.readouterr().err


@pytest.mark.slow
def test_a_target_without_rsync_names_the_package(
    target_without_rsync: SshTarget,
    deploy: Deploy,
    root: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert deploy(target_without_rsync) == Status.NOT_DEPLOYED
    assert "rsync: not found; install Debian package rsync" in capsys.readouterr().err
    assert list(root.iterdir()) == []


@pytest.mark.slow
def test_every_fault_of_a_target_is_said_at_once(
    target: SshTarget, deploy: Deploy, root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old = root / "python3"
    old.write_text("#!/bin/sh\necho 3.9.2\n")
    old.chmod(0o755)
    foreign = root / "opt/firmware-runtime/venv"
    foreign.mkdir(parents=True)
    assert deploy(target, "--python", old) == Status.NOT_DEPLOYED
    said = capsys.readouterr().err
    assert f"{old} is 3.9.2; expected 3.11 or later" in said
    assert f"{foreign}: no link that a deployment made; move it away" in said


@pytest.mark.slow
def test_a_wheel_that_was_cut_off_is_refused_here(
    target: SshTarget,
    deploy: Deploy,
    root: Path,
    wheel: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    cut = root.with_name(wheel.name)
    cut.write_bytes(wheel.read_bytes()[:-2000])
    assert deploy(target, "--wheel", cut) == Status.NOT_DEPLOYED
    assert "expected a wheel" in capsys.readouterr().err
    assert list(root.iterdir()) == []


@pytest.mark.slow
def test_a_fleet_whose_computers_ask_for_signatures(  # noqa: PLR0917 -- fixtures
    target: SshTarget,
    deploy: Deploy,
    root: Path,
    wheel: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    builder, stranger = make_key(tmp_path / "builder"), make_key(tmp_path / "stranger")
    signers = root / "etc/firmware-runtime/allowed_signers"
    signers.parent.mkdir(parents=True)
    signers.write_text(f"builder {builder.with_suffix('.pub').read_text()}")
    home = root / "opt/firmware-runtime"
    assert deploy(target) == Status.NOT_DEPLOYED
    assert "it takes no version that is not signed; --sign KEY" in capsys.readouterr().err
    assert deploy(target, "--sign", stranger) == Status.NOT_DEPLOYED
    assert f"not signed by a key of {signers}\n" in capsys.readouterr().err
    assert list(home.iterdir()) == []

    robot = f"""
    host = "{HOST}"
    board = "tachobot"
    identity = "{target.identity}"
    ssh_options = ["UserKnownHostsFile={target.folder}/known_hosts"]
    """
    ports = {"near": target.port, "far": free_port(), "last": target.port}
    fleet = tmp_path / "fleet.toml"
    fleet.write_text("".join(f"[{name}]\nport={port}{robot}\n" for name, port in ports.items()))
    fixed = ["--root", root, "--wheel", wheel, "--python", DEBIANS_PYTHON, "--force"]
    words = ["deploy", "--all", fleet, "--sign", builder, *fixed]
    assert main([str(word) for word in (*words, "--dry-run")]) == Status.NOT_DEPLOYED
    assert list(home.iterdir()) == []
    capsys.readouterr()
    assert main([str(word) for word in words]) == Status.NOT_DEPLOYED
    printed = capsys.readouterr()
    table = [line.split(maxsplit=1) for line in printed.out.splitlines()[-3:]]
    assert [name for name, _ in table] == list(ports)
    assert [told.partition(":")[0] for _, told in table] == ["done", "failed", "not done"]
    assert "Connection refused" in printed.err
    assert (home / "venv/manifest.sig").is_file()
