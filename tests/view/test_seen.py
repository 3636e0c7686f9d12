"""What a page shows, as a file: these ports, this stretch of time, by the one writer of exports."""

import csv
import io
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from rosbags.highlevel import AnyReader

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.live import seen
from firmware_runtime.recording.exports import run_file
from tests.support.recorded import record

PARQUET: Any = import_module("pyarrow.parquet")
COMMAND = "controller.yaw.command_n"
LATER = SECOND * 85 // 100


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("run") / "x.recording", "tachobot", 1.0)


def rows_of(content: bytes) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(content.decode())))


@pytest.mark.slow
def test_tables_have_these_ports_and_this_stretch_alone(run: Path) -> None:
    ports = [COMMAND, "imu.sample.temperature_c"]
    rows = rows_of(seen.exported(run, ports, LATER, LATER + SECOND // 10, "csv"))
    assert {row["port"] for row in rows} == {COMMAND, "imu.sample"}
    assert {row["field"] for row in rows} == {"", "temperature_c"}
    ats = [int(row["t_ns"]) for row in rows]
    assert LATER <= min(ats) < max(ats) <= LATER + SECOND // 10
    content = seen.exported(run, ports, LATER, LATER + SECOND // 10, "parquet")
    table = PARQUET.read_table(io.BytesIO(content)).to_pylist()
    assert [row["t_ns"] for row in table] == ats


@pytest.mark.slow
def test_one_port_has_its_fields_as_columns(run: Path) -> None:
    rows = rows_of(seen.exported(run, [COMMAND], 0, SECOND, "csv"))
    assert list(rows[0]) == ["t_ns", "t_s", "utc", "value"]


@pytest.mark.slow
def test_an_mcap_has_these_ports_and_the_markers(run: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(seen.exported(run, [COMMAND], 0, 2 * SECOND, "mcap"))
    with AnyReader([path]) as reader:
        topics = {each.topic for each in reader.connections}
    assert topics == {"/tachobot/ports/controller/yaw/command_n", "/tachobot/markers"}


@pytest.mark.parametrize(
    ("ports", "stretch", "ending", "why"),
    [
        ([COMMAND], (0, SECOND), "json", "csv, parquet, mcap"),
        (["controller.yaw.comand_n"], (0, SECOND), "csv", "did you mean"),
        ([COMMAND], (SECOND, 0), "csv", "expected an instant after"),
        ([COMMAND], (5 * SECOND, 6 * SECOND), "csv", "the run ends at 1 s"),
    ],
)
def test_what_cannot_be_exported_is_refused(
    run: Path, ports: list[str], stretch: tuple[int, int], ending: str, why: str
) -> None:
    with pytest.raises(ConfigError, match=why):
        seen.exported(run, ports, *stretch, ending)


def test_a_missing_extra_is_named(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_name: str, extra: str) -> None:
        raise ConfigError.of_one("pyarrow", "not installed", expected=f"the extra {extra}")

    monkeypatch.setattr(run_file, "module_of_extra", missing)
    with pytest.raises(ConfigError, match="the extra parquet"):
        seen.exported(run, [COMMAND], 0, SECOND, "parquet")
