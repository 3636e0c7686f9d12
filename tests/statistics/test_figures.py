"""The typed figures say what statistics said before they had types, for the same files."""

import gzip
import json
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.difference_text import difference_of
from firmware_runtime.statistics.figures import Figures, figures_of
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

GOLDEN = Path(__file__).parent / "golden"
"""Files that runs have written, and what `stats --json` printed of them in schema 1."""
RUNS = ("uneven", "troubled", "real", "virtual")


def kept(name: str, folder: Path) -> Statistics:
    path = folder / f"{name}.stats"
    path.write_bytes(gzip.decompress((GOLDEN / f"{name}.stats.gz").read_bytes()))
    return read_statistics(path)


def printed(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((GOLDEN / f"{name}.json").read_text())
    found.pop("takeovers", None)  # a guard's, beside the statistics
    return found


@pytest.mark.parametrize("name", RUNS)
def test_the_json_of_a_file_is_what_it_always_was(name: str, tmp_path: Path) -> None:
    assert kept(name, tmp_path).as_json() == printed(name)


def test_a_difference_is_what_it_always_was(tmp_path: Path) -> None:
    first, second = (kept(name, tmp_path) for name in ("uneven", "troubled"))
    assert difference_of(first, second).as_json() == printed("uneven-troubled")


@pytest.mark.parametrize("name", RUNS)
def test_figures_come_back_from_their_json(name: str, tmp_path: Path) -> None:
    assert figures_of(json.dumps(printed(name)), "here") == kept(name, tmp_path).figures()


def test_figures_have_types(tmp_path: Path) -> None:
    figures = kept("real", tmp_path).figures()
    imu = figures.models["imu"]
    assert (imu.kind, imu.period_us, figures.rate_hz) == ("periodic", 10_000, 100)
    assert figures.conditions.run.state == "ended"
    assert figures.conditions.settings["fifo_priority"].asked == 60
    assert figures.lateness_us.max == max(
        model.lateness_us.max or 0 for model in figures.models.values()
    )
    assert isinstance(figures, Figures)


@pytest.mark.parametrize(
    ("damage", "where"),
    [
        ({"schema": 2}, "schema: invalid value 2"),
        ({"run": "many"}, "run: expected `int`, got `str`"),
        ({"models": {"imu": {}}}, "models[...]: object missing"),
        ({"conditions": None}, "conditions: expected `object`, got `null`"),
    ],
)
def test_json_of_another_shape_is_refused_with_its_place(
    damage: dict[str, Any], where: str
) -> None:
    with pytest.raises(StatisticsFileError) as refusal:
        figures_of(json.dumps({**printed("real"), **damage}), "robot.local")
    assert str(refusal.value).startswith("robot.local: ")
    assert where in str(refusal.value)


@pytest.mark.parametrize("text", ["", "no JSON", "[]", "[" * 100_000])
def test_what_is_no_json_is_refused(text: str) -> None:
    with pytest.raises(StatisticsFileError):
        figures_of(text, "robot.local")
