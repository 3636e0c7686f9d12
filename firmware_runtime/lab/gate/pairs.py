"""Pairs of costs of a board, a model or a command: both versions at once, on one processor.

Two processes on one processor take turns of a few milliseconds, so both have the same neighbours
and the same clock. A cost is processor time, in which waiting for the other is not. Each pair has
new processes: where one lies in memory changes its cost. The seed draws which is started first.
"""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Generator, Sequence
from contextlib import ExitStack, suppress
from functools import partial
from itertools import cycle
from math import log
from pathlib import Path
from random import Random

from msgspec import Struct, json

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.gate.checkouts import Checkout
from firmware_runtime.system.resources import Closing
from firmware_runtime.system.signals import signals_held

LONGEST_S = 600.0
"""A process that takes longer is given up."""
_CONTESTANT = str(Path(__file__).with_name("contestant.py"))
_OUR_CLASS = re.compile(r"^firmware_runtime[\w.]*: ")

Versions = tuple[Checkout, Checkout]


class Stretch(Struct, frozen=True):
    """Processor time of so much robot time, or of a run (1); `used` modules of the checkout."""

    span_s: float
    ns: int
    activations: int
    used: int


class Pair(Struct, frozen=True):
    """The cost of the same work in both versions."""

    base: Stretch
    head: Stretch

    @property
    def log_ratio(self) -> float:
        """The logarithm of HEAD's cost by BASE's."""
        return log(self.head.ns / self.base.ns)


def measured_pairs(
    versions: Versions, words: Sequence[str], seed: int
) -> Generator[Pair, None, None]:
    """Pairs without end, of a board and its settings, or of `--` and a command.

    What the first processes compile and read is no cost; they say how long a stretch has to be.
    Raises ConfigError for versions that cannot be compared.
    """
    turns = _turns(seed)
    first = _pair(versions, ["0", *words], *next(turns))
    for checkout, side in zip(versions, (first.base, first.head), strict=True):
        board = (checkout.folder / words[0]).resolve()
        if side.used == 0 and not (board.is_relative_to(checkout.folder) and board.exists()):
            fault = f"{words[0]} uses no module of it; expected a checkout of its package"
            raise ConfigError.of_one("gate", f"{checkout.name} {checkout.stated}: {fault}")
    for turn in turns:
        yield _pair(versions, [f"{first.base.span_s}", *words], *turn)


def last_error(said: str) -> str:
    """The last error of what Python printed, in a line: what is indented belongs to it."""
    lines = said.rstrip().splitlines()
    begins = max((at for at, line in enumerate(lines) if not line.startswith(" ")), default=0)
    return _OUR_CLASS.sub("", " ".join(line.strip() for line in lines[begins:]))


def _turns(seed: int) -> Generator[tuple[int, tuple[int, int]], None, None]:
    """The processors that may be used, over and over, and which version is started first."""
    draws = Random(seed)  # noqa: S311 -- no secret
    processors = sorted(os.sched_getaffinity(0))
    draws.shuffle(processors)
    for cpu in cycle(processors):
        yield cpu, draws.choice(((0, 1), (1, 0)))


def _pair(versions: Versions, words: Sequence[str], cpu: int, order: tuple[int, int]) -> Pair:
    with ExitStack() as stack:
        running: dict[int, _Contestant] = {}
        for which in order:
            with signals_held():  # or a signal could part it from what ends it
                contestant = _Contestant(versions[which], [str(cpu), *words])
                running[which] = stack.enter_context(contestant)
        return Pair(running[0].stretch(), running[1].stretch())


class _Contestant(Closing):
    """A process in its version's folder, in a session of its own: Ctrl-C is for the verb.

    `close` ends it with all that it has started.
    """

    def __init__(self, checkout: Checkout, words: Sequence[str]) -> None:
        self._failure = partial(ConfigError.of_one, f"{checkout.name} {checkout.stated}")
        self._process = subprocess.Popen(  # noqa: S603 -- this interpreter
            [sys.executable, "-P", _CONTESTANT, os.pathsep.join(checkout.path), *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            cwd=checkout.folder,
            env=checkout.environment,
            start_new_session=True,
        )

    def stretch(self) -> Stretch:
        """Wait for what it found. Raises ConfigError where it found nothing."""
        try:
            printed, said = self._process.communicate(timeout=LONGEST_S)
        except subprocess.TimeoutExpired as error:
            raise self._failure(f"no end in {LONGEST_S:g} s; expected a shorter run") from error
        if self._process.returncode != 0:
            raise self._failure(last_error(said.decode(errors="replace")))
        return json.decode(printed.rstrip().rpartition(b"\n")[2], type=Stretch)

    def close(self) -> None:
        """End it, and what it has started and left behind."""
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.communicate()
