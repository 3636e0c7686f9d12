"""A measurement that is made for many seeds, by processes of their own, with progress."""

import argparse
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import TypeVar

T = TypeVar("T")


def add_seed_options(parser: argparse.ArgumentParser, plants: int) -> None:
    """Add --json, and how many plants there are: a seed each."""
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--plants", type=int, default=plants)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=None, help="default: one a processor")


def by_seed(judged: Callable[[int], T], chosen: argparse.Namespace) -> list[T]:
    """What is found for each seed, in order; how far it is goes to standard error."""
    found: list[T] = []
    with ProcessPoolExecutor(chosen.processes) as pool:
        seeds = range(chosen.first_seed, chosen.first_seed + chosen.plants)
        for each in pool.map(judged, seeds):
            found.append(each)
            print(f"\r{len(found)}/{chosen.plants} plants", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return found
