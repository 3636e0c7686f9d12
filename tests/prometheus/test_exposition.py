"""What Prometheus reads: exact counts, conventions of its own tools, a real exporter scraped."""

import http.client
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from prometheus_client.parser import text_string_to_metric_families

from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.statistics import fault_table
from firmware_runtime.statistics import statistics as statistics_module
from firmware_runtime.statistics.fault_table import FaultCount
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.histogram import Histogram, bucket_of, upper_edge
from firmware_runtime.statistics.layout import (
    BUS,
    DEADLINE,
    HEARTBEAT,
    MODEL,
    STEP_HISTOGRAM,
    Layout,
)
from firmware_runtime.statistics.metrics import (
    BOUNDS,
    StatisticsCollector,
    exposition,
    text_of,
)
from firmware_runtime.statistics.metrics_server import exporter, serve
from firmware_runtime.system import packages
from tests.support.command import Command, started
from tests.support.executives import Run
from tests.support.phased_models import FIFTY_HZ, Phased
from tests.support.waiting import PATIENCE_S

LAYOUT = Layout(
    models=("imu",),
    timed=("imu",),
    buses=("i2c1",),
    deadlines=("yaw",),
    worst=1,
    fault_models=("imu", "compass"),
)
HEADER = {
    "models": {"imu": {"period_ns": 10_000_000, "tolerance_ns": 1_000_000, "policy": "skip"}},
    "conditions": {"board": "tachobot", "kernel": 'a "quoted" one', "scheduler_priority": 60},
}
SAMPLES = (500, 1_023, 1_024, 70_000, 3_000_000_000)


@pytest.fixture
def directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    return tmp_path


@pytest.fixture
def file(directory: Path) -> StatisticsFile:
    file = StatisticsFile(LAYOUT, HEADER, directory / "tachobot.stats")
    file.open_section()
    first = LAYOUT.model(0)
    for name, value in (("scheduled", 7), ("run", 5), ("skipped", 2), ("overruns", 1)):
        file.cells[first + MODEL.index(name)] = value
    for sample in SAMPLES:
        Histogram(file.cells[LAYOUT.lateness(0)]).record(sample)
    Histogram(file.cells[STEP_HISTOGRAM]).record(500)
    file.cells[LAYOUT.deadline(0) + DEADLINE.index("misses")] = 3
    file.cells[LAYOUT.bus(0) + BUS.index("busy_ns")] = 250 * MILLISECOND
    fault_table.fill(file.cells[LAYOUT.faults], 0, [FaultCount("NotReady", 7, 0, 5, "not yet")])
    file.close_section(1_000_000_000)
    return file


def samples(text: str) -> dict[tuple[str, ...], float]:
    """Values by name and labels' values."""
    return {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def test_counters_and_histograms_are_exact(file: StatisticsFile) -> None:
    found = samples(exposition("tachobot", file.statistics()))
    assert found["firmware_runtime_activations_total", "tachobot", "imu", "skipped"] == 2
    assert found["firmware_runtime_lateness_seconds_count", "tachobot", "imu"] == len(SAMPLES)
    assert found["firmware_runtime_lateness_seconds_sum", "tachobot", "imu"] == sum(SAMPLES) / 1e9
    assert found["firmware_runtime_deadline_misses_total", "tachobot", "yaw"] == 3
    assert found["firmware_runtime_bus_busy_seconds_total", "tachobot", "i2c1"] == 0.25
    for edge in BOUNDS:
        labels = ("firmware_runtime_lateness_seconds_bucket", "tachobot", repr(edge / 1e9), "imu")
        assert found[labels] == sum(sample <= edge for sample in SAMPLES)


def test_virtual_time_has_counts_and_no_sample_of_a_time() -> None:
    sensor = Phased("sensor", 20 * MILLISECOND, FIFTY_HZ)
    run = Run(sensor, VirtualClock())
    run.until(SECOND)
    found = samples(exposition("robot", run.executive.statistics))
    assert found["firmware_runtime_activations_total", "robot", "sensor", "run"] == 51
    assert found["firmware_runtime_lateness_seconds_count", "robot", "sensor"] == 0
    assert found["firmware_runtime_own_time_seconds_count", "robot", "sensor"] == 0
    assert found["firmware_runtime_step_seconds_count", "robot"] == 0


@pytest.mark.parametrize("edge", BOUNDS)
def test_bounds_are_edges_of_buckets(edge: int) -> None:
    assert upper_edge(bucket_of(edge)) == edge


@pytest.mark.skipif(shutil.which("promtool") is None, reason="needs the Debian package prometheus")
def test_prometheus_own_tool_finds_nothing_to_blame(file: StatisticsFile) -> None:
    text = exposition("tachobot", file.statistics())
    checked = subprocess.run(
        ["promtool", "check", "metrics"], input=text, capture_output=True, text=True, check=False
    )
    assert (checked.returncode, checked.stdout, checked.stderr) == (0, "", "")


def test_a_board_that_cannot_be_read_is_down(directory: Path) -> None:
    (directory / "broken.stats").write_text("nothing")
    collector = StatisticsCollector(lambda: {"broken": directory / "broken.stats"})
    assert samples(text_of(collector)) == {("firmware_runtime_up", "broken"): 0}


def test_a_loop_that_has_not_begun_has_no_heartbeat_and_no_guard(directory: Path) -> None:
    file = StatisticsFile(LAYOUT, HEADER, directory / "tachobot.stats")
    found = samples(exposition("tachobot", file.statistics()))
    assert found["firmware_runtime_guarded", "tachobot"] == 0
    assert found["firmware_runtime_overloaded", "tachobot"] == 0
    assert ("firmware_runtime_heartbeat_age_seconds", "tachobot") not in found


def test_the_age_of_a_heartbeat_is_in_seconds(
    file: StatisticsFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    last = file.cells[HEARTBEAT]
    monkeypatch.setattr(statistics_module, "monotonic_ns", lambda: last + 205 * MILLISECOND)
    found = samples(exposition("tachobot", file.statistics()))
    assert found["firmware_runtime_heartbeat_age_seconds", "tachobot"] == 0.205


def test_a_text_file_is_for_all_users_and_whole(
    file: StatisticsFile, directory: Path, command: Command
) -> None:
    target = directory / "robot.prom"
    assert main(["stats", "--prometheus", str(target)]) == 0
    assert target.stat().st_mode & 0o777 == 0o644
    assert samples(target.read_text())["firmware_runtime_up", "tachobot"] == 1
    assert [path.name for path in directory.glob(".*")] == []
    assert "x.prom: No such file or directory" in command.refused(
        "stats", "--prometheus", directory / "missing" / "x.prom"
    )
    assert file.layout.cells > 0


def test_stats_prints_the_same(file: StatisticsFile, directory: Path, command: Command) -> None:
    printed = samples(
        command.said("stats", "--prometheus", "--statistics", directory / "tachobot.stats")
    )
    name = ("firmware_runtime_overruns_total", "tachobot", "imu")
    assert printed[name] == samples(exposition("tachobot", file.statistics()))[name] == 1


def test_an_exporter_that_answers_keeps_its_socket(tmp_path: Path, command: Command) -> None:
    path = tmp_path / "metrics.sock"
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(os.fspath(path))
        other.listen()
        assert "Address already in use" in command.refused("stats", "--serve", f"unix:{path}")
    assert path.is_socket()


def test_faults_are_counted_by_model_and_kind(file: StatisticsFile) -> None:
    found = samples(exposition("tachobot", file.statistics()))
    faults = {name: value for name, value in found.items() if "faults" in name[0]}
    assert faults == {("firmware_runtime_faults_total", "tachobot", "NotReady", "imu"): 7}


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "prometheus_client", None)
    monkeypatch.delitem(sys.modules, "firmware_runtime.statistics.metrics_server", raising=False)
    with pytest.raises(ConfigError, match="the extra metrics"):
        packages.module_of_extra("firmware_runtime.statistics.metrics_server", "metrics")


@pytest.mark.timeout(PATIENCE_S)
def test_it_serves_for_as_long_as_is_waited(tmp_path: Path) -> None:
    found: list[float] = []

    def ask(_where: str) -> None:
        with socket.socket(socket.AF_UNIX) as wire:
            wire.connect(os.fspath(tmp_path / "metrics.sock"))
            connection = http.client.HTTPConnection("localhost")
            connection.sock = wire
            found.append(samples(body_of(connection))["firmware_runtime_up", "tachobot"])

    broken = StatisticsCollector(lambda: {"tachobot": tmp_path / "missing.stats"})
    serve(f"unix:{tmp_path / 'metrics.sock'}", broken, ask)
    assert found == [0]


@pytest.mark.parametrize("listen", ["127.0.0.1:0", "127.8.9.10:0"])
def test_it_listens_on_the_loopback_interface(listen: str) -> None:
    with exporter(listen, StatisticsCollector(dict)) as server:
        assert listen.partition(":")[0] in str(server.server_address)


@contextmanager
def exporting(listen: str) -> Iterator[str]:
    """The real exporter in a process of its own; gives what it says it listens on."""
    with started("stats", "--serve", listen) as process:
        assert process.stdout is not None
        yield process.stdout.readline()
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=PATIENCE_S) == 0


def body_of(connection: http.client.HTTPConnection) -> str:
    connection.request("GET", "/metrics")
    return connection.getresponse().read().decode()


@pytest.mark.slow
def test_the_exporter_answers_on_loopback_with_what_holds_now(file: StatisticsFile) -> None:
    with exporting("127.0.0.1:0") as said:
        start, _, port_text = said.rpartition(":")
        assert start == "serving metrics on 127.0.0.1"
        port = int(port_text)
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
        name = ("firmware_runtime_overruns_total", "tachobot", "imu")
        assert samples(body_of(connection))[name] == 1
        file.cells[LAYOUT.model(0) + MODEL.index("overruns")] = 4
        assert samples(body_of(connection))[name] == 4


@pytest.mark.slow
def test_the_exporter_answers_on_a_unix_socket(file: StatisticsFile, tmp_path: Path) -> None:
    path = tmp_path / "metrics.sock"
    with socket.socket(socket.AF_UNIX) as gone:
        gone.bind(os.fspath(path))  # what an exporter that was killed has left
    with exporting(f"unix:{path}") as said, socket.socket(socket.AF_UNIX) as wire:
        assert said == f"serving metrics on unix:{path}\n"
        wire.connect(os.fspath(path))
        connection = http.client.HTTPConnection("localhost")
        connection.sock = wire
        assert samples(body_of(connection))["firmware_runtime_up", "tachobot"] == 1
    assert file.layout.cells > 0
