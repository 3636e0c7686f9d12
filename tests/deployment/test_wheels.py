import json
from pathlib import Path

import pytest

from firmware_runtime.host.deployment import project_wheel, wheels
from firmware_runtime.host.deployment.commands import Commands, Ended
from firmware_runtime.host.deployment.errors import DeploymentError
from firmware_runtime.host.deployment.platform import Platform

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
def test_pip_is_asked_for_the_same_as_is_taken(machine: str, python: tuple[int, int]) -> None:
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
    wanted = [*wheels.EXTRAS, *project_wheel.requirements(wheel)]
    lock = {"wanted": wanted, "files": wheels._sums([file])}
    (folder / wheels.LOCK).write_text(json.dumps(lock))
    return file


@pytest.mark.slow
def test_what_is_in_the_cache_is_not_downloaded(
    tmp_path: Path, wheel: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    fill_cache(wheel, PI)
    told = wheels.collect(NoCommands(print), PI, wheel, tmp_path / "wheels")
    assert "from the cache" in told
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


def test_another_project_than_ours_is_refused(tmp_path: Path) -> None:
    cache = tmp_path / "no.whl"
    cache.write_bytes(b"no archive")
    with pytest.raises(DeploymentError, match="expected the project's wheel"):
        project_wheel.requirements(cache)


def test_without_a_checkout_a_wheel_has_to_be_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(project_wheel, "checkout", lambda: None)
    with pytest.raises(DeploymentError, match="expected --wheel FILE"):
        project_wheel.build(NoCommands(print), tmp_path)


@pytest.mark.slow
def test_all_that_a_raspberry_pi_needs_comes_as_wheels_that_fit(
    tmp_path: Path, wheel: Path
) -> None:
    wheels.collect(Commands(print), PI, wheel, tmp_path / "wheels")
    names = [file.name for file in (tmp_path / "wheels").iterdir()]
    assert all(PI.takes(name) for name in names)
    projects = {name.split("-")[0] for name in names}
    assert projects > {"firmware_runtime", "numpy", "msgspec", "smbus2", "pyserial", "sdnotify"}
    assert any("aarch64" in name for name in names)
    assert not any("x86_64" in name for name in names)
