import platform
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from firmware_runtime.host.deployment import package_wheel, wheels
from firmware_runtime.host.deployment.connection import Commands
from firmware_runtime.host.deployment.target import Platform
from tests.support.made_once import made_once
from tests.support.scratch_system import ScratchSystem, scratch_system
from tests.support.ssh_target import SshTarget, missing_packages, ssh_target

DEBIANS_PYTHON = "/usr/bin/python3"
_COMMANDS = Commands(print)


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache of wheels for the whole session."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="session")
def downloaded(tmp_path_factory: pytest.TempPathFactory, cache: Path, wheel: Path) -> Path:
    """The cache with the wheels for this computer, downloaded once for all workers."""

    def download(into: Path) -> Path:
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("XDG_CACHE_HOME", str(into / "cache"))
            wheels.collect(_COMMANDS, this_computer(), wheel, into / "parcel")
        return into / "cache"

    filled = made_once(tmp_path_factory, "downloaded", download)
    return Path(shutil.copytree(filled, cache, dirs_exist_ok=True))


def this_computer() -> Platform:
    """This computer with its Debian's Python, which a deployment to it finds."""
    asked = [DEBIANS_PYTHON, "-c", "import sys; print(*sys.version_info[:2])"]
    answer = subprocess.run(asked, capture_output=True, text=True, check=True).stdout
    major, minor = map(int, answer.split())
    return Platform(platform.machine(), (major, minor))


@pytest.fixture(autouse=True)
def _own_cache(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The project's wheel, built once."""
    return made_once(
        tmp_path_factory, "wheel", lambda into: package_wheel.build_own(_COMMANDS, into)
    )


@pytest.fixture
def target(tmp_path: Path) -> Iterator[SshTarget]:
    """This computer, by ssh."""
    _demand_ssh()
    with ssh_target(tmp_path / "ssh") as started:
        yield started


@pytest.fixture
def target_without_rsync(tmp_path: Path) -> Iterator[SshTarget]:
    """The same, with every program but one."""
    _demand_ssh()
    programs = tmp_path / "programs"
    programs.mkdir()
    for folder in (Path("/usr/bin"), Path("/bin")):
        for program in folder.iterdir():
            if program.name != "rsync" and not (programs / program.name).exists():
                (programs / program.name).symlink_to(program)
    with ssh_target(tmp_path / "ssh", path=str(programs)) as started:
        yield started


@pytest.fixture
def system(tmp_path: Path) -> Iterator[ScratchSystem]:
    """A system to install into."""
    if shutil.which("unshare") is None:
        pytest.skip("unshare not found; install Debian package util-linux")
    try:
        with scratch_system(tmp_path / "system") as started:
            yield started
    except OSError as error:
        pytest.skip(f"no overlay in a mount namespace: {error}; expected to run as root")


def _demand_ssh() -> None:
    if missing := missing_packages():
        pytest.skip(f"nothing to deploy to; install Debian packages {missing}")
