"""Wheels that are made here: of the project, and of installed packages such as a user's own robot.

The project's is built from the checkout, or packed from what is installed. A package that is
installed editable is built from its folder. Any other is packed again from the files that were
installed: that takes neither its source, nor a build tool, nor the network.

pip notes where it installed a package from if that was a folder, a file or a repository
(direct_url.json, PEP 610). Such a one is taken along as it is here, even if an index has another of
that name. One with compiled parts is left to the index: what is here may not fit the target.
"""

import fnmatch
import json
import re
import shutil
import sys
from base64 import urlsafe_b64encode
from collections.abc import Callable, Collection, Iterable, Iterator
from email import message_from_string
from hashlib import sha256
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final
from urllib.parse import unquote, urlsplit
from zipfile import ZIP_DEFLATED, BadZipFile, ZipFile

from firmware_runtime.board.installed import entry_point_of, names
from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment.connection import Commands
from firmware_runtime.system.packages import normal_name

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
        name = entry_point_of(kind).package
        if name != OUR_OWN:
            found[name] = distribution(name)
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
    tags = _tags(package)
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


_NAME: Final = re.compile(r"[A-Za-z0-9._-]+")


def with_local_dependencies(packages: Iterable[Distribution]) -> list[Distribution]:
    """These packages, and those they need, directly or not, that are from no index."""
    found: dict[str, Distribution] = {}
    left = list(packages)
    while left:
        package = left.pop(0)
        if found.setdefault(package.name, package) is package:
            left += _local(package)
    return list(found.values())


def _local(package: Distribution) -> Iterator[Distribution]:
    for required in package.requires or ():
        name, _, condition = required.partition(";")
        match = _NAME.match(name)
        if match is None or "extra" in condition or normal_name(match[0]) == OUR_OWN:
            continue
        try:
            needed = distribution(match[0])
        except PackageNotFoundError:
            continue  # not for this computer; the index may have it for the target
        if needed.read_text("direct_url.json") is not None and _is_pure(needed):
            yield needed


def _is_pure(package: Distribution) -> bool:
    tags = _tags(package)
    return bool(tags) and all(tag.endswith("-none-any") for tag in tags)


def _tags(package: Distribution) -> list[str]:
    return re.findall(r"^Tag: (.+)$", package.read_text("WHEEL") or "", re.MULTILINE)


def checkout() -> Path | None:
    """The source that this program runs from, None if it was installed from a wheel."""
    top = Path(__file__).parents[3]
    return top if (top / "pyproject.toml").is_file() else None


def build_own(commands: Commands, into: Path) -> Path:
    """Make the wheel in a folder. Raises DeploymentError."""
    source = checkout()
    if source is None:
        return packed_again(distribution(OUR_OWN), into)
    return built(source, OUR_OWN, commands, into)


def demand_ours(wheel: Path) -> None:
    """Raise DeploymentError for a wheel of another project."""
    name = metadata_of(wheel)[0]
    if name != OUR_OWN:
        raise DeploymentError(name, where=wheel, expected=f"{OUR_OWN}'s wheel")


def requirements(wheel: Path) -> list[str]:
    """The requirements of a wheel, in order. Raises DeploymentError when it is none."""
    return sorted(metadata_of(wheel)[1])


def metadata_of(wheel: Path) -> tuple[str, list[str]]:
    """The name of what is in a wheel, and its requirements. Raises DeploymentError."""
    try:
        with ZipFile(wheel) as archive:
            inside = [name for name in archive.namelist() if name.endswith(".dist-info/METADATA")]
            metadata = message_from_string(archive.read(inside[0]).decode())
    except (OSError, BadZipFile, IndexError) as error:
        raise DeploymentError(error, where=wheel, expected="a wheel") from error
    return metadata["Name"], metadata.get_all("Requires-Dist", [])
