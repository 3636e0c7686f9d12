"""What both versions run in: one interpreter, each with its checkout first on the import path."""

import os
from collections.abc import Mapping, Sequence

from firmware_runtime.gate.checkouts import Checkout

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "1")


def environment(checkout: Checkout) -> Mapping[str, str]:
    """The environment of a version: the order of sets and dicts is the same in both."""
    before = os.environ.get("PYTHONPATH")
    path = [*checkout.import_path, *([before] if before else [])]
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(path),
        "PYTHONHASHSEED": "0",
        ONE_THREAD[0]: os.environ.get(*ONE_THREAD),
    }


def processors() -> Sequence[int]:
    """The processors that may be used. Both versions of a pair run on one of them, the same."""
    return sorted(os.sched_getaffinity(0))
