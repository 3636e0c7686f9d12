"""What a robot's package needs and no index has is taken along; the rest is downloaded."""

from importlib.metadata import distribution
from pathlib import Path

import pytest

from firmware_runtime.host.deployment.package_wheel import with_local_dependencies

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
