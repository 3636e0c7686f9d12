import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.cli.commands import bench
from firmware_runtime.errors import Status

CHECKOUT = Path(__file__).parents[2]


def test_where_there_is_no_checkout_it_says_so_in_a_sentence(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench, "checkout", lambda: None)
    ended = command("bench", "devstone")
    assert (ended.status, ended.out) == (Status.BAD_INPUT, "")
    assert len(ended.error.splitlines()) == 1


def test_every_name_is_a_folder_with_a_bench(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    for name in bench._BENCHES:
        assert bench._bench(CHECKOUT, name).SUMMARY


def test_every_folder_of_a_bench_has_a_name() -> None:
    folders = {each.parent.name for each in (CHECKOUT / "benchmarks").glob("*/bench.py")}
    assert folders == set(bench._BENCHES)
