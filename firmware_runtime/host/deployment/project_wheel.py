"""The project's own wheel: built from the checkout, or packed from what is installed."""

from email import message_from_string
from importlib.metadata import distribution
from pathlib import Path
from zipfile import BadZipFile, ZipFile

from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment.commands import Commands
from firmware_runtime.host.deployment.package_wheel import OUR_OWN, built, packed_again

NAME = "firmware_runtime"


def checkout() -> Path | None:
    """The source that this program runs from, None if it was installed from a wheel."""
    top = Path(__file__).parents[3]
    return top if (top / "pyproject.toml").is_file() else None


def build(commands: Commands, into: Path) -> Path:
    """Make the wheel in a folder. Raises DeploymentError."""
    source = checkout()
    if source is None:
        return packed_again(distribution(OUR_OWN), into)
    return built(source, OUR_OWN, commands, into)


def demand_ours(wheel: Path) -> None:
    """Raise DeploymentError for a wheel of another project."""
    name = _metadata(wheel)[0]
    if name != OUR_OWN:
        raise DeploymentError(name, where=wheel, expected=f"{OUR_OWN}'s wheel")


def requirements(wheel: Path) -> list[str]:
    """The requirements of a wheel, in order. Raises DeploymentError when it is none."""
    return sorted(_metadata(wheel)[1])


def _metadata(wheel: Path) -> tuple[str, list[str]]:
    """The name of what is in a wheel, and its requirements."""
    try:
        with ZipFile(wheel) as archive:
            inside = [name for name in archive.namelist() if name.endswith(".dist-info/METADATA")]
            metadata = message_from_string(archive.read(inside[0]).decode())
    except (OSError, BadZipFile, IndexError) as error:
        raise DeploymentError(error, where=wheel, expected="a wheel") from error
    return metadata["Name"], metadata.get_all("Requires-Dist", [])
