import json
from importlib.metadata import Distribution, distribution
from pathlib import Path
from zipfile import ZipFile

import pytest

from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment import package_wheel, wheels
from firmware_runtime.host.deployment.connection import Commands
from firmware_runtime.host.deployment.target import Platform
from firmware_runtime.host.scaffold.package import write_robot
from firmware_runtime.system.programs import Ended
from tests.support.written_package import as_installed

PI = Platform("aarch64", (3, 11))
TAKEN = [
    "smbus2-0.6.1-py2.py3-none-any.whl",
    "numpy-2.4.6-cp311-cp311-manylinux_2_27_aarch64.manylinux_2_28_aarch64.whl",
    "msgspec-0.22.0-cp311-cp311-manylinux2014_aarch64.manylinux_2_17_aarch64.whl",
    "gpiod-2.5.0-cp39-abi3-manylinux_2_17_aarch64.whl",
    "a-1-7-py311-none-any.whl",
]
REFUSED = [
    "numpy-2.4.6-cp312-cp312-manylinux_2_28_aarch64.whl",
    "numpy-2.4.6-cp311-cp311-manylinux_2_28_x86_64.whl",
    "numpy-2.4.6-cp311-cp311-manylinux_2_34_aarch64.whl",
    "numpy-2.4.6-cp311-cp311-musllinux_1_2_aarch64.whl",
    "a-1-cp311-cp311-linux_aarch64.whl",
    "a-1-cp312-abi3-manylinux_2_17_aarch64.whl",
    "a-1-py2-none-any.whl",
    "a-1-py312-none-any.whl",
    "a-1.tar.gz",
    "a.whl",
]


@pytest.mark.parametrize("name", TAKEN)
def test_a_wheel_that_fits_is_taken(name: str) -> None:
    assert PI.takes(name)


@pytest.mark.parametrize("name", REFUSED)
def test_a_wheel_for_another_computer_is_not_taken(name: str) -> None:
    assert not PI.takes(name)


@pytest.mark.parametrize("python", [(3, 11), (3, 14)])
@pytest.mark.parametrize("machine", ["aarch64", "x86_64"])
def test_pip_downloads_what_is_taken(machine: str, python: tuple[int, int]) -> None:
    platform = Platform(machine, python)
    options = platform.pip_options
    assert "--only-binary=:all:" in options
    assert f"--python-version=3.{python[1]}" in options
    for tag in platform.tags:
        assert f"--platform={tag}" in options
        assert platform.takes(f"a-1-cp3{python[1]}-cp3{python[1]}-{tag}.whl")
    assert platform.tags[0] == f"manylinux_2_28_{machine}"


class NoCommands(Commands):
    """What must not run anything."""

    def run(self, command: object, scripts: object = ()) -> Ended:
        raise AssertionError(f"{command}: nothing was to be run, with {scripts}")


def fill_cache(wheel: Path, platform: Platform) -> Path:
    """A cache as a download would leave it."""
    folder = wheels.cache_directory() / str(platform)
    folder.mkdir(parents=True)
    file = folder / "smbus2-0.6.1-py2.py3-none-any.whl"
    file.write_bytes(b"smbus2")
    wanted = [*wheels.EXTRAS, *package_wheel.requirements(wheel)]
    lock = {"wanted": wanted, "files": wheels._sums([file])}
    (folder / wheels.LOCK).write_text(json.dumps(lock))
    return file


@pytest.mark.slow
def test_what_is_in_the_cache_is_not_downloaded(
    tmp_path: Path, wheel: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    fill_cache(wheel, PI)
    reported = wheels.collect(NoCommands(print), PI, wheel, tmp_path / "wheels")
    assert "from the cache" in reported.text
    names = {file.name for file in (tmp_path / "wheels").iterdir()}
    assert names == {wheel.name, "smbus2-0.6.1-py2.py3-none-any.whl"}


@pytest.mark.slow
def test_a_file_of_the_cache_that_has_changed_is_not_trusted(
    tmp_path: Path, wheel: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    fill_cache(wheel, PI).write_bytes(b"something else")
    with pytest.raises(AssertionError, match="nothing was to be run"):
        wheels.collect(NoCommands(print), PI, wheel, tmp_path / "wheels")


def test_what_is_no_wheel_is_refused(tmp_path: Path) -> None:
    cache = tmp_path / "no.whl"
    cache.write_bytes(b"no archive")
    with pytest.raises(DeploymentError, match="expected a wheel"):
        package_wheel.requirements(cache)


def test_a_package_is_packed_again_from_what_was_installed(tmp_path: Path) -> None:
    installed = distribution("smbus2")
    wheel = package_wheel.wheel_of(installed, NoCommands(print), tmp_path)
    assert PI.takes(wheel.name)
    assert wheel.name.startswith(f"smbus2-{installed.version}-")
    with ZipFile(wheel) as archive:
        names = archive.namelist()
        record = f"smbus2-{installed.version}.dist-info/RECORD"
        assert set(names) >= {"smbus2/smbus2.py", record.replace("RECORD", "WHEEL")}
        listed = [line.split(",")[0] for line in archive.read(record).decode().splitlines()]
    assert sorted(listed) == sorted(names)
    assert not [name for name in names if "__pycache__" in name or ".." in name]
    assert package_wheel.requirements(wheel) == sorted(installed.requires or [])


@pytest.mark.slow
def test_a_wheel_packed_again_can_be_installed(tmp_path: Path) -> None:
    wheel = package_wheel.packed_again(distribution("smbus2"), tmp_path)
    into = [*package_wheel.PIP, "install", "--no-deps", "--no-index", "--target"]
    Commands(print).demand([*into, str(tmp_path / "site"), str(wheel)], "not installed")
    assert (tmp_path / "site/smbus2/smbus2.py").is_file()


def test_an_editable_package_is_built_from_its_folder(tmp_path: Path) -> None:
    reported: list[str] = []
    write_robot("heron", tmp_path / "a heron")
    package = as_installed(tmp_path / "a heron", tmp_path / "site")
    found = Distribution.discover(name="heron", path=[str(package.site)])
    wheel = package_wheel.wheel_of(
        next(iter(found)), Commands(reported.append, dry_run=True), tmp_path
    )
    assert wheel.name == "heron-VERSION-py3-none-any.whl"
    assert f"'{package.folder}'" in reported[0]


def test_a_package_that_no_wheel_was_made_of_is_refused(tmp_path: Path) -> None:
    (tmp_path / "old-1.0.dist-info").mkdir()
    (tmp_path / "old-1.0.dist-info/METADATA").write_text("Name: old\nVersion: 1.0\n")
    found = next(iter(Distribution.discover(name="old", path=[str(tmp_path)])))
    with pytest.raises(DeploymentError, match="old: not installed from a wheel"):
        package_wheel.wheel_of(found, NoCommands(print), tmp_path)


def test_our_own_boards_bring_no_other_package_and_an_unknown_one_is_refused() -> None:
    assert package_wheel.packages_of({"tachobot", "detective"}) == []
    with pytest.raises(DeploymentError, match="'heron'"):
        package_wheel.packages_of({"tachobot", "heron"})


def test_another_project_than_ours_is_refused(tmp_path: Path) -> None:
    wheel = package_wheel.packed_again(distribution("smbus2"), tmp_path)
    with pytest.raises(DeploymentError, match="smbus2; expected firmware-runtime"):
        package_wheel.demand_ours(wheel)


@pytest.mark.slow
def test_all_that_a_raspberry_pi_needs_comes_as_wheels_that_fit(
    tmp_path: Path, wheel: Path
) -> None:
    wheels.collect(Commands(print), PI, wheel, tmp_path / "wheels")
    names = [file.name for file in (tmp_path / "wheels").iterdir()]
    assert all(PI.takes(name) for name in names)
    projects = {name.split("-")[0] for name in names}
    assert projects > {"firmware_runtime", "msgspec", "smbus2", "pyserial", "sdnotify"}
    assert any("aarch64" in name for name in names)
    assert not any("x86_64" in name for name in names)
