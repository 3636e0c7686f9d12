"""The computer that wheels are for: which of them fit, and how pip downloads those."""

from dataclasses import dataclass
from itertools import product

MACHINES = ("aarch64", "x86_64")
LEAST_PYTHON = (3, 11)
GLIBC = (2, 28)
"""The C library that wheels may need; every Debian and Ubuntu with a Python of ours has a newer."""

_OLDEST_GLIBC = 17
"""Its minor version in manylinux2014, the oldest there is for aarch64."""


@dataclass(frozen=True, slots=True)
class Platform:
    """CPython of one version on one processor, under Linux with glibc."""

    machine: str
    python: tuple[int, int]

    def __str__(self) -> str:
        return f"{self.interpreter}-{self.machine}"

    @property
    def interpreter(self) -> str:
        """As in a wheel's name: `cp311`."""
        return f"cp{self.python[0]}{self.python[1]}"

    @property
    def tags(self) -> list[str]:
        """The platforms a wheel may be built for, the newest first."""
        newest = GLIBC[1]
        versions = [f"manylinux_2_{minor}" for minor in range(newest, _OLDEST_GLIBC - 1, -1)]
        return [f"{version}_{self.machine}" for version in [*versions, "manylinux2014"]]

    @property
    def pip_options(self) -> list[str]:
        """Options of `pip download`; it takes wheels only."""
        options = ["--only-binary=:all:", "--implementation=cp"]
        options += [f"--python-version={self.python[0]}.{self.python[1]}"]
        options += [f"--abi={abi}" for abi in (self.interpreter, "abi3", "none")]
        return [*options, *(f"--platform={tag}" for tag in self.tags)]

    def takes(self, file_name: str) -> bool:
        """Whether a wheel of this name can be installed there."""
        stem, _, suffix = file_name.rpartition(".")
        words = stem.split("-")
        if suffix != "whl" or len(words) < 5:
            return False
        pythons, abis, platforms = (word.split(".") for word in words[-3:])
        fitting = self._pythons_and_abis()
        return not {"any", *self.tags}.isdisjoint(platforms) and any(
            pair in fitting for pair in product(pythons, abis)
        )

    def _pythons_and_abis(self) -> set[tuple[str, str]]:
        minors = range(self.python[1] + 1)
        return {
            ("py3", "none"),
            (self.interpreter, "none"),
            (self.interpreter, self.interpreter),
            *((f"py3{minor}", "none") for minor in minors),
            *((f"cp3{minor}", "abi3") for minor in minors),
        }
