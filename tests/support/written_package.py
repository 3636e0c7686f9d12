"""A package written by `new`, and processes that see it as installed, without building anything."""

import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.support.command import ended_program
from tests.support.waiting import PATIENCE_S

CHECKOUT = Path(__file__).parents[2]


@dataclass(frozen=True)
class WrittenPackage:
    """A package's folder, and a folder with the metadata that an installation would leave."""

    folder: Path
    site: Path

    @property
    def environment(self) -> dict[str, str]:
        """What makes package and entry points visible to a Python that is started."""
        found = f"{self.site}{os.pathsep}{self.folder}"
        typed = os.pathsep.join(str(CHECKOUT / folder) for folder in ("", "drivers", "boards"))
        return {**os.environ, "PYTHONPATH": found, "MYPYPATH": typed}

    def python(
        self, *words: str | Path, cwd: Path | None = None
    ) -> subprocess.CompletedProcess[str]:
        """Run Python to its end, in the package's folder unless another is meant."""
        return ended_program(
            [sys.executable, *words],
            check=False,
            cwd=cwd or self.folder,
            env=self.environment,
        )

    def command(
        self, *words: str | Path, cwd: Path | None = None
    ) -> subprocess.CompletedProcess[str]:
        """Run `firmware-runtime` to its end."""
        return self.python("-m", "firmware_runtime.cli", *words, cwd=cwd)

    def types(self, seen: Path, *folders: str) -> subprocess.CompletedProcess[str]:
        """Let mypy check folders, strictly; as a user has it, what they import is silent.

        `seen` is its cache.
        """
        options = ("--strict", "--follow-imports=silent", "--explicit-package-bases")
        return self.python("-m", "mypy", *options, "--cache-dir", seen, *folders)

    @contextmanager
    def running(self, *words: str, until: str) -> Iterator["subprocess.Popen[str]"]:
        """Start `firmware-runtime` and wait for a line with this in it; end it by SIGTERM."""
        process = subprocess.Popen(
            [sys.executable, "-m", "firmware_runtime.cli", *words],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert process.stdout is not None
            assert any(until in line for line in process.stdout), f"{words}: ended without {until}"
            yield process
        finally:
            process.terminate()
            process.communicate(timeout=PATIENCE_S)


def as_installed(folder: Path, site: Path) -> WrittenPackage:
    """The package of a folder with a pyproject.toml, its metadata written below `site`."""
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    metadata = site / f"{project['name']}-{project['version']}.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    (metadata / "entry_points.txt").write_text("\n".join(_lines(project["entry-points"])))
    (metadata / "direct_url.json").write_text(
        f'{{"url": "{folder.as_uri()}", "dir_info": {{"editable": true}}}}'
    )
    return WrittenPackage(folder, site)


def _lines(groups: Mapping[str, Mapping[str, Any]]) -> Sequence[str]:
    return [
        line
        for group, entries in groups.items()
        for line in (f"[{group}]", *(f"{name} = {value}" for name, value in entries.items()))
    ]
