"""Pairs of stretches of virtual time of a board on its doubles, or of a model alone.

Both versions go through the same instants in turns, on one processor: BASE, HEAD, HEAD, BASE, or
the other way round as drawn by the seed, and the costs of two stretches are one cost of a pair. A
dozen pairs later both begin again in new processes and on another processor: where a process lies
in memory changes its cost a little, and so do its neighbours on a processor.
"""

from collections.abc import Generator, Sequence
from contextlib import ExitStack
from itertools import cycle
from random import Random

from firmware_runtime.errors import ConfigError
from firmware_runtime.gate.checkouts import Checkout, refused
from firmware_runtime.gate.pairs import Pair
from firmware_runtime.gate.side import Side, Stretch
from firmware_runtime.gate.surroundings import processors

PAIRS_A_ROUND = 12
WARMING_S = 2.0
"""Robot time of each before the first pair of a round: bring-up, and what is imported late."""
TRIES = 3
"""Stretches of a span whose cheapest says what it costs."""
LEAST_NS = 8_000_000
"""What a stretch costs at least: the clock, the pipe and a tick of the kernel are little then."""
LEAST_ACTIVATIONS = 20
LONGEST_SPAN_S = 1e6
SHORTEST_SPAN_S = 0.01

Versions = tuple[Checkout, Checkout]


class BoardPairs:
    """Measures a board or MODULE:CLASS in two versions."""

    unit = "1 s of robot time"

    def __init__(
        self, versions: Versions, word: str, assignments: Sequence[str], seed: int
    ) -> None:
        self._versions, self._word, self._assignments = versions, word, list(assignments)
        self._draws = Random(seed)  # noqa: S311 -- no secret
        self._span_s = 0.0
        self._activations = [0, 0]
        self._unlike = 0

    @property
    def units(self) -> float:
        """Seconds of robot time in one cost: two stretches."""
        return 2 * self._span_s

    def notes(self) -> list[str]:
        """Where the runs of the versions were not alike."""
        found = []
        base, head = self._activations
        if base != head:
            found.append(f"in the same robot time BASE had {base} activations, HEAD {head}")
        if self._unlike:
            found.append(f"{self._unlike} pairs left out: the run of one version only was over")
        return found

    def pairs(self) -> Generator[Pair, None, None]:
        """Pairs without end. Raises ConfigError for versions that cannot be compared."""
        cpus = list(processors())
        self._draws.shuffle(cpus)
        for cpu in cycle(cpus):
            with ExitStack() as ends:
                sides = [ends.enter_context(self._side(each)) for each in self._versions]
                self._check_used([side.wait() for side in sides])
                yield from self._round(sides, cpu)

    # ---------------------------------------------------------------------------------------------

    def _side(self, checkout: Checkout) -> Side:
        return Side(checkout, self._word, self._assignments)

    def _check_used(self, used: list[int]) -> None:
        """Refuse to compare what is installed with itself. Raises ConfigError."""
        faults = [
            f"{checkout.name} {checkout.stated}: {self._word} uses no module of it; expected a "
            "checkout of its package"
            for checkout, count in zip(self._versions, used, strict=True)
            if count == 0 and not self._is_within(checkout)
        ]
        if faults:
            raise refused(faults)

    def _is_within(self, checkout: Checkout) -> bool:
        """Whether the board is a file of the checkout itself."""
        board = (checkout.folder / self._word).resolve()
        return board.is_relative_to(checkout.folder) and board.exists()

    def _round(self, sides: list[Side], cpu: int) -> Generator[Pair, None, None]:
        if self._span_s == 0.0:
            _warm(sides, cpu)
            self._span_s = self._suitable_span(sides, cpu)
            for side in sides:
                side.begin_again()
        _warm(sides, cpu)
        found = 0
        for _ in range(PAIRS_A_ROUND):
            pair = self._pair(sides, cpu)
            if pair is not None:
                found += 1
                yield pair
        if found == 0:
            fault = "a run of BASE is never over when one of HEAD is; expected runs that end alike"
            raise ConfigError.of_one(self._word, fault)

    def _pair(self, sides: list[Side], cpu: int) -> Pair | None:
        """BASE, HEAD, HEAD, BASE or the other way round; None where their runs were not alike."""
        order = [0, 1, 1, 0] if self._draws.random() < 0.5 else [1, 0, 0, 1]
        taken: tuple[list[Stretch], list[Stretch]] = ([], [])
        for which in order:
            taken[which].append(sides[which].stretch(cpu, self._span_s))
        base, head = taken
        if [each.is_over for each in base] != [each.is_over for each in head]:
            self._unlike += 1
            for side in sides:
                side.begin_again()
            return None
        for which, stretches in enumerate(taken):
            self._activations[which] += sum(each.activations for each in stretches)
        return Pair(sum(each.ns for each in base), sum(each.ns for each in head))

    def _suitable_span(self, sides: list[Side], cpu: int) -> float:
        """The shortest span, doubled from the least on, that costs enough and holds enough.

        Both versions go through the same, and that of BASE counts.
        """
        span_s = SHORTEST_SPAN_S
        while span_s < LONGEST_SPAN_S:
            tried, _ = zip(*(_both(sides, cpu, span_s) for _ in range(TRIES)), strict=True)
            cheapest = min(tried, key=lambda each: each.ns)
            if all(each.activations == 0 and each.is_over for each in tried):
                break
            is_enough = cheapest.ns >= LEAST_NS and cheapest.activations >= LEAST_ACTIVATIONS
            if is_enough or all(each.is_over for each in tried):
                return span_s
            span_s *= 2
        raise ConfigError.of_one(
            self._word, "nothing happens in it by itself; expected a board or a model that runs"
        )


def _warm(sides: list[Side], cpu: int) -> None:
    """Bring them up; where that is more than a whole run of one, all begin at the first instant."""
    warmed = [side.stretch(cpu, WARMING_S) for side in sides]
    if any(each.is_over for each in warmed):
        for side in sides:
            side.begin_again()


def _both(sides: list[Side], cpu: int, span_s: float) -> tuple[Stretch, Stretch]:
    base, head = sides
    return base.stretch(cpu, span_s), head.stretch(cpu, span_s)
