"""The project's own wheel: built from the checkout, or brought along; and what it asks for."""

import fnmatch
import shutil
import sys
from collections.abc import Callable
from email import message_from_string
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import BadZipFile, ZipFile

from firmware_runtime.host.deployment.commands import Commands
from firmware_runtime.host.deployment.errors import DeploymentError

NAME = "firmware_runtime"
PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")

_NOT_BUILT = (".*", "build", "dist", "docs", "tests", "*.egg-info")


def checkout() -> Path | None:
    """The source that this program runs from, None if it was installed from a wheel."""
    top = Path(__file__).parents[3]
    return top if (top / "pyproject.toml").is_file() else None


def build(commands: Commands, into: Path) -> Path:
    """Build the wheel into a folder. Raises DeploymentError without a checkout."""
    source = checkout()
    if source is None:
        raise DeploymentError(
            f"{Path(__file__).parents[3]}: no pyproject.toml, so no wheel can be built; "
            "expected --wheel FILE with the project's wheel"
        )
    with TemporaryDirectory() as temporary:
        # A copy, so that nothing left in build/ by an earlier version gets into the wheel.
        copied = source if commands.dry_run else Path(temporary, "source")
        if not commands.dry_run:
            shutil.copytree(source, copied, ignore=_left_out(source))
        words = [*PIP, "wheel", "--no-deps", "--wheel-dir", str(into)]
        commands.demand([*words, str(copied)], f"{source}: no wheel")
    built = sorted(into.glob(f"{NAME}-*.whl"))
    return built[0] if built else into / f"{NAME}-VERSION-py3-none-any.whl"


def requirements(wheel: Path) -> list[str]:
    """What a wheel of the project asks for. Raises DeploymentError when it is none."""
    try:
        with ZipFile(wheel) as archive:
            inside = [name for name in archive.namelist() if name.endswith(".dist-info/METADATA")]
            metadata = message_from_string(archive.read(inside[0]).decode())
    except (OSError, BadZipFile, IndexError) as error:
        raise DeploymentError(f"{wheel}: {error}; expected the project's wheel") from error
    if metadata["Name"] != "firmware-runtime":
        raise DeploymentError(f"{wheel}: {metadata['Name']}; expected firmware-runtime's wheel")
    return sorted(metadata.get_all("Requires-Dist", []))


def _left_out(source: Path) -> Callable[[str, list[str]], list[str]]:
    """For copytree: what of the checkout's top folder does not belong to the wheel."""

    def left_out(folder: str, names: list[str]) -> list[str]:
        if Path(folder) != source:
            return []
        return [name for name in names if any(fnmatch.fnmatch(name, each) for each in _NOT_BUILT)]

    return left_out
