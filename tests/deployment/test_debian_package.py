import re
import shutil
import subprocess
from pathlib import Path

import pytest

from firmware_runtime.host.deployment.commands import Commands
from firmware_runtime.host.deployment.debian.build import build, platform_for
from firmware_runtime.host.deployment.errors import DeploymentError
from firmware_runtime.host.deployment.platform import Platform
from tests.support.made_once import made_once
from tests.support.scratch_system import GUARD, PROGRAM, ROBOT, SETTINGS, ScratchSystem


@pytest.fixture(scope="module")
def package(
    tmp_path_factory: pytest.TempPathFactory,
    downloaded: Path,
    wheel: Path,
) -> Path:
    """The package for this computer's Debian, built once."""
    if shutil.which("dpkg-deb") is None:
        pytest.skip("dpkg-deb not found; install Debian package dpkg")
    commands = Commands(print)

    def make(into: Path) -> Path:
        return build(commands, platform_for(commands, None, None), into, wheel)

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(downloaded))
        return made_once(tmp_path_factory, "package", make)


def newer(package: Path, into: Path) -> Path:
    """The same package, of a later version."""
    tree = into / "newer"
    subprocess.run(["dpkg-deb", "-R", package, tree], check=True)
    control = tree / "DEBIAN" / "control"
    control.write_text(re.sub(r"(?m)^Version: .*$", "Version: 99", control.read_text()))
    built = into / "newer.deb"
    words = ["dpkg-deb", "--root-owner-group", "-Znone", "--build", str(tree), str(built)]
    subprocess.run(words, check=True, capture_output=True)
    return built


def install(system: ScratchSystem, package: Path) -> "subprocess.CompletedProcess[str]":
    shutil.copy(package, system.folder / "the.deb")
    return system.run("dpkg", "-i", system.folder / "the.deb")


@pytest.mark.slow
def test_the_package_is_what_dpkg_expects(package: Path, tmp_path: Path) -> None:
    fields = subprocess.run(
        ["dpkg-deb", "-f", package], capture_output=True, text=True, check=True
    ).stdout
    assert re.search(
        r"^Depends: python3 \(>= 3\.\d+\), python3 \(<< 3\.\d+\), ", fields, re.MULTILINE
    )
    assert f"_{re.findall('Architecture: (.*)', fields)[0]}.deb" in package.name
    listed = subprocess.run(
        ["dpkg-deb", "-c", package], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    assert {line.split()[1] for line in listed} == {"root/root"}
    assert {line.split()[0] for line in listed} == {"drwxr-xr-x", "-rw-r--r--", "lrwxrwxrwx"}
    assert any(line.endswith(f"./usr/bin/firmware-runtime -> {PROGRAM}") for line in listed)

    subprocess.run(["dpkg-deb", "-R", package, tmp_path / "tree"], check=True)
    sums = tmp_path / "tree/DEBIAN/md5sums"
    words = ["md5sum", "--check", "--quiet", str(sums)]
    subprocess.run(words, cwd=tmp_path / "tree", check=True)
    files = {path for path in (tmp_path / "tree/usr").rglob("*") if path.is_file()}
    assert len(sums.read_text().splitlines()) == len([x for x in files if not x.is_symlink()])
    assert {"copyright", "changelog.gz"} <= {path.name for path in files}


@pytest.mark.slow
def test_installing_upgrading_and_purging(
    system: ScratchSystem, package: Path, tmp_path: Path
) -> None:
    installed = install(system, package)
    assert installed.returncode == 0, installed.stderr
    assert "tachobot" in system.run("/usr/bin/firmware-runtime", "boards").stdout
    assert system.run("firmware-runtime", "service", "install", "tachobot").returncode == 0
    system.write(SETTINGS, system.read(SETTINGS) + "# mine\n")
    assert system.read("/run/units").split() == [GUARD, ROBOT]
    system.let_safe_state_end_with(0)

    upgraded = install(system, newer(package, tmp_path))
    assert upgraded.returncode == 0, upgraded.stderr
    assert "upgrade" in system.read("/run/safe-state.log")
    stops = [line for line in system.read("/run/systemctl.log").splitlines() if "stop" in line]
    assert stops == [f"stop {ROBOT}", f"stop {GUARD}"]
    assert system.read("/run/units").split() == [GUARD, ROBOT], "what ran runs again"
    assert system.read(SETTINGS).endswith("# mine\n")
    assert len(system.run("sh", "-c", "ls -d /opt/firmware-runtime/venv.*").stdout.split()) == 1

    system.let_safe_state_end_with(0)
    removed = system.run("dpkg", "-r", "firmware-runtime")
    assert removed.returncode == 0, removed.stderr
    assert system.read("/run/units") == ""
    assert not system.has("/opt/firmware-runtime")
    assert system.has(SETTINGS)
    assert system.run("dpkg", "-P", "firmware-runtime").returncode == 0
    left = system.run("find", "/etc", "/opt", "/run", "/usr", "-path", "*firmware-runtime*").stdout
    assert left.split() == []


@pytest.mark.slow
def test_the_program_stays_with_a_robot_that_cannot_be_switched_off(
    system: ScratchSystem, package: Path, tmp_path: Path
) -> None:
    version = ("dpkg-query", "-W", "-f", "${Status} ${Version}", "firmware-runtime")
    assert install(system, package).returncode == 0
    before = system.run(*version).stdout
    assert system.run("firmware-runtime", "service", "install", "tachobot").returncode == 0
    system.let_safe_state_end_with(4)

    # Nor does the newer version overrule the one that is there.
    upgraded = install(system, newer(package, tmp_path))
    assert upgraded.returncode != 0
    assert "a robot could not be made safe, so the program stays" in upgraded.stderr
    assert "are stopped and stay so" in upgraded.stderr
    assert system.read("/run/units").split() == [GUARD], "it goes on trying"
    assert system.run(*version).stdout == before

    assert system.run("systemctl", "start", ROBOT).returncode == 0
    assert system.run("dpkg", "-r", "firmware-runtime").returncode != 0
    assert system.read("/run/units").split() == [GUARD]
    assert system.has(PROGRAM)

    # The power was cut. No robot runs any more, so nothing speaks against it.
    again = system.run("dpkg", "-r", "firmware-runtime")
    assert again.returncode == 0, again.stderr
    assert "tachobot did not run and does not answer" in again.stderr
    assert not system.has(PROGRAM)


@pytest.mark.parametrize(
    ("architecture", "python", "platform"),
    [
        ("arm64", "3.12", Platform("aarch64", (3, 12))),
        ("amd64", "3.14", Platform("x86_64", (3, 14))),
    ],
)
def test_a_package_for_another_computer_can_be_built(
    architecture: str, python: str, platform: Platform
) -> None:
    assert platform_for(Commands(print), architecture, python) == platform


@pytest.mark.parametrize(
    ("architecture", "python", "said"),
    [
        ("armhf", "3.11", "ARCH=armhf: expected"),
        ("arm64", "3.9", "PYTHON_VERSION=3.9: expected"),
        ("arm64", "bookworm", "PYTHON_VERSION=bookworm: expected"),
    ],
)
def test_one_that_the_project_does_not_run_on_is_refused(
    architecture: str, python: str, said: str
) -> None:
    with pytest.raises(DeploymentError, match=said):
        platform_for(Commands(print), architecture, python)
