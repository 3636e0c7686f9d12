"""Packages of a test's own, as installed into this process, and gone with the test."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import invalidate_caches
from pathlib import Path

from firmware_runtime.system import packages


@contextmanager
def installed_here(
    site: Path, name: str, files: Mapping[str, str], entries: str, *, provider: str | None = None
) -> Iterator[Path]:
    """Install a package of these files; `entries` is what its entry_points.txt holds.

    `provider` is what the distribution is called, the package's name unless stated. Yields the
    package's folder.
    """
    package = site / name
    for path, text in {"__init__.py": "", **files}.items():
        (package / path).parent.mkdir(parents=True, exist_ok=True)
        (package / path).write_text(text)
    metadata = site / f"{provider or name}-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Name: {provider or name}\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(entries)
    sys.path.insert(0, str(site))
    _forget()
    try:
        yield package
    finally:
        sys.path.remove(str(site))
        for module in [each for each in sys.modules if each.partition(".")[0] == name]:
            del sys.modules[module]
        _forget()


def _forget() -> None:
    """What is installed is looked up again."""
    for each in (packages.installed, packages._all, packages._folders):
        each.cache_clear()
    invalidate_caches()
