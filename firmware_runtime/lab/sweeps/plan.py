"""Sweeps, and the values of each of their rows: a pure function of seed, row and key.

Grids (`range`, `linspace`) are gone through in all combinations, the key that is named last the
fastest; drawn values are drawn again in every row. `runs` is how many rows there are: by default
each point of the grid once; with more, the grid begins again, with fewer, it is left early.
"""

import hashlib
import math
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Final, Literal, TypeAlias

from msgspec import Struct, field

from firmware_runtime.board.assignments import assignments_of
from firmware_runtime.lab.sweeps.distributions import Distribution, Grid, Value, distribution

Sampling: TypeAlias = Literal["random", "lhs"]
SAMPLINGS: Final = ("random", "lhs")
_CELLS: Final = 2.0**-52


class Sweep(Struct, frozen=True, kw_only=True):
    """A sweep in words; equal sweeps have equal tables, wherever and in what order they run."""

    board: str
    """As the command line has it: a name, or the path of a board.toml or its folder."""
    vary: dict[str, str]
    """Distributions by key, in order."""
    assignments: list[str] = field(default_factory=list)
    """Overrides that hold in every row, `KEY=VALUE`."""
    runs: int | None = None
    seed: int = 0
    for_s: float | None = None
    experiment: str | None = None
    sampling: Sampling = "random"

    @property
    def size(self) -> int:
        """Number of rows; 0 if nothing says so."""
        return self.grid_size if self.runs is None else self.runs

    @property
    def grid_size(self) -> int:
        """Number of points of the grid; 0 if there is none."""
        sizes = [each.size for each in self.distributions().values() if isinstance(each, Grid)]
        return math.prod(sizes) if sizes else 0

    @property
    def has_grid_left_over(self) -> bool:
        """Return whether the rows do not go through the grid a whole number of times."""
        grid = self.grid_size
        return grid > 0 and self.size % grid != 0

    def distributions(self) -> Mapping[str, Distribution]:
        """Return the distribution of each key. Raises ValueError."""
        return _distributions(tuple(self.vary.items()))

    def values(self, row: int) -> dict[str, Value]:
        """The value of each key that is varied, in a row."""
        found: dict[str, Value] = {}
        point = row
        for key, each in reversed(list(self.distributions().items())):
            if isinstance(each, Grid):
                point, index = divmod(point, each.size)
                found[key] = each.level(index)
            else:
                found[key] = each.quantile(self._share(row, key))
        return {key: found[key] for key in self.vary}

    def command(self) -> Iterator[str]:
        """Yield the words of its command."""
        yield f"sweep {self.board}"
        yield from (f"--vary '{key}={words}'" for key, words in self.vary.items())
        yield from (f"--set {each}" for each in self.assignments)
        yield from (
            f"--{name} {value}"
            for name, value in (
                ("runs", self.runs),
                ("seed", self.seed),
                ("for", self.for_s),
                ("experiment", self.experiment),
                ("sampling", self.sampling),
            )
            if value is not None
        )

    def row_assignments(self, row: int) -> list[str]:
        """All overrides of a row, as `--set` has them."""
        return [*self.assignments, *assignments_of(self.values(row))]

    def _share(self, row: int, key: str) -> float:
        share = _share(self.seed, row, key)
        if self.sampling == "random":
            return share
        ranks = _ranks(self.seed, key, self.size)
        return (ranks[row] + share) / self.size


def _share(seed: int, row: int, key: str) -> float:
    """A number between 0 and 1, from a hash: it depends on nothing that ran before."""
    digest = hashlib.blake2b(f"{seed}:{row}:{key}".encode(), digest_size=8).digest()
    return ((int.from_bytes(digest) >> 12) + 0.5) * _CELLS


@lru_cache(maxsize=64)
def _ranks(seed: int, key: str, rows: int) -> list[int]:
    """A permutation of the rows: in Latin hypercube sampling each row has a stratum of its own."""
    order = sorted(range(rows), key=lambda row: _share(seed, row, f"rank of {key}"))
    ranks = [0] * rows
    for rank, row in enumerate(order):
        ranks[row] = rank
    return ranks


@lru_cache(maxsize=16)
def _distributions(vary: tuple[tuple[str, str], ...]) -> Mapping[str, Distribution]:
    return {key: distribution(words) for key, words in vary}
