"""Folders of a checkout in which Python finds its packages."""

from pathlib import Path


def import_path(checkout: Path) -> list[Path]:
    """Return `src` and the folders directly in a checkout that hold packages; then itself.

    A folder that is a package is imported from the checkout itself; what lies deeper, such as in
    an environment or in another checkout, is not its own.
    """
    inside = sorted(each for each in checkout.iterdir() if each.is_dir())
    return [*(each for each in inside if _holds_packages(each)), checkout]


def _holds_packages(folder: Path) -> bool:
    if folder.name.startswith(".") or (folder / "__init__.py").exists():
        return False
    return folder.name == "src" or any(folder.glob("*/__init__.py"))
