"""The wheel of an installed package, such as a robot of a user's own.

A package that is installed editable is built from its folder. Any other is packed again from the
files that were installed: that takes neither its source, nor a build tool, nor the network.
"""

import fnmatch
import json
import re
import shutil
import sys
from base64 import urlsafe_b64encode
from collections.abc import Callable, Collection, Iterator
from hashlib import sha256
from importlib.metadata import Distribution
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import unquote, urlsplit
from zipfile import ZIP_DEFLATED, ZipFile

from firmware_runtime.board.installed import entry_point_of, names
from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment.commands import Commands

PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")
OUR_OWN = "firmware-runtime"

_NOT_BUILT = (".*", "build", "dist", "venv", "*.egg-info", "__pycache__")
_OF_INSTALLER = {"INSTALLER", "RECORD", "REQUESTED", "direct_url.json"}
"""What of the metadata is not the package's."""


def packages_of(kinds: Collection[str]) -> list[Distribution]:
    """The packages that provide these kinds of board, beside the project's own.

    Raises DeploymentError for a kind whose package is not installed here.
    """
    found: dict[str, Distribution] = {}
    for kind in sorted(kinds):
        if kind not in names():
            raise DeploymentError(
                f"a board {kind!r} is installed there, and its package is not here, so "
                "the new program would not know it",
                expected="it installed here too",
            )
        package = entry_point_of(kind).dist
        if package is not None and package.name != OUR_OWN:
            found[package.name] = package
    return list(found.values())


def wheel_of(package: Distribution, commands: Commands, into: Path) -> Path:
    """Put the wheel of an installed package into a folder. Raises DeploymentError."""
    source = _editable(package)
    if source is not None:
        return built(source, package.name, commands, into)
    return packed_again(package, into)


def built(source: Path, name: str, commands: Commands, into: Path) -> Path:
    """Build the wheel of a source folder. Raises DeploymentError."""
    with TemporaryDirectory() as temporary:
        # A copy, so that nothing left in build/ by an earlier version gets into the wheel.
        copied = source if commands.dry_run else Path(temporary, "source")
        if not commands.dry_run:
            shutil.copytree(source, copied, ignore=_left_out(source))
        words = [*PIP, "wheel", "--no-deps", "--wheel-dir", str(into)]
        commands.demand([*words, str(copied)], f"{source}: no wheel")
    stem = re.sub(r"[-_.]+", "_", name)
    found = sorted(into.glob(f"{stem}-*.whl"))
    return found[0] if found else into / f"{stem}-VERSION-py3-none-any.whl"


def packed_again(package: Distribution, into: Path) -> Path:
    """Write the wheel that a package was installed from. Raises DeploymentError."""
    tags = re.findall(r"^Tag: (.+)$", package.read_text("WHEEL") or "", re.MULTILINE)
    if not tags or package.files is None:
        raise DeploymentError(
            "not installed from a wheel, so none can be made",
            where=package.name,
            expected="`pip install` to have installed it",
        )
    parts = zip(*(tag.split("-") for tag in tags), strict=True)
    tag = "-".join(".".join(dict.fromkeys(each)) for each in parts)
    stem = f"{re.sub(r'[-_.]+', '_', package.name)}-{package.version}"
    wheel = into / f"{stem}-{tag}.whl"
    record = ""
    with ZipFile(wheel, "w", ZIP_DEFLATED) as archive:
        for name, content in _installed(package):
            archive.writestr(name, content)
            digest = urlsafe_b64encode(sha256(content).digest()).rstrip(b"=").decode()
            record += f"{name},sha256={digest},{len(content)}\n"
        place = f"{_metadata(package)}/RECORD"
        archive.writestr(place, f"{record}{place},,\n")
    return wheel


def _installed(package: Distribution) -> Iterator[tuple[str, bytes]]:
    """The files of a package that are its own, by their places in a wheel."""
    metadata = _metadata(package)
    for file in package.files or ():
        of_installer = file.parent.name == metadata and file.name in _OF_INSTALLER
        if file.parts[0] != ".." and "__pycache__" not in file.parts and not of_installer:
            yield file.as_posix(), Path(str(file.locate())).read_bytes()


def _metadata(package: Distribution) -> str:
    """The name of the folder with its metadata."""
    inside = (file.parent.name for file in package.files or () if file.name == "METADATA")
    return next(name for name in inside if name.endswith(".dist-info"))


def _editable(package: Distribution) -> Path | None:
    """The folder of a package that is installed editable; None for any other."""
    origin = json.loads(package.read_text("direct_url.json") or "{}")
    if not origin.get("dir_info", {}).get("editable", False):
        return None
    return Path(unquote(urlsplit(origin["url"]).path))


def _left_out(source: Path) -> Callable[[str, list[str]], list[str]]:
    """For copytree: what of the top folder does not belong to the wheel."""

    def left_out(folder: str, names: list[str]) -> list[str]:
        if Path(folder) != source:
            return []
        return [name for name in names if any(fnmatch.fnmatch(name, each) for each in _NOT_BUILT)]

    return left_out
