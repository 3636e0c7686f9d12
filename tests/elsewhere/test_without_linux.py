"""What works where Linux is not, with all hidden that it alone has; what does not says so.

`tests/support/not_linux` hides it: no test here has run on macOS.
"""

import json
import os
import sys
from pathlib import Path

import pytest

from firmware_runtime.cli.verbs import OF_LINUX
from firmware_runtime.errors import Status
from tests.support.command import COMMAND, ended_program

pytestmark = pytest.mark.slow

PRELUDE = Path(__file__).parents[1] / "support/not_linux"
EXAMPLE = Path(__file__).parents[2] / "examples/pan_tilt"

HIDDEN = """
import ctypes, os, select, socket, sys, time
assert sys.platform == "darwin"
assert not hasattr(os, "sched_getscheduler") and not hasattr(os, "eventfd")
assert not hasattr(select, "epoll") and not hasattr(time, "CLOCK_BOOTTIME")
assert not hasattr(ctypes.PyDLL(None), "timerfd_create")
for look in (open, os.stat, os.listdir):
    try:
        look("/proc/self")
    except FileNotFoundError:
        continue
    raise AssertionError(look)
try:
    socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
except OSError:
    print("hidden")
"""
IMPORTS = """
import importlib, pkgutil
for name in ("firmware_runtime", "firmware_drivers", "firmware_boards", "sim_doubles"):
    package = importlib.import_module(name)
    for each in pkgutil.walk_packages(package.__path__, f"{name}."):
        if "links.ros2." not in each.name and not each.name.endswith("__main__"):
            importlib.import_module(each.name)
print("imported")
"""
EACH = """
import io, json, sys
from contextlib import redirect_stderr, redirect_stdout
from firmware_runtime.cli.main import main
ended = []
for words in json.loads(sys.argv[1]):
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()) as said:
        try:
            status = main(words)
        except SystemExit as end:
            status = end.code
    ended.append({"words": words, "status": status, "error": said.getvalue()})
print(json.dumps(ended))
"""


class Elsewhere:
    """Programs on a system without what Linux alone has, with a folder for what they leave."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._environment = {
            **os.environ,
            "PYTHONPATH": str(PRELUDE),
            "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(folder),
        }

    def _ended(self, *words: object) -> tuple[int, str, str]:
        ended = ended_program(
            [*words], check=False, env=self._environment, cwd=self.folder, stdin=-3
        )
        return ended.returncode, ended.stdout, ended.stderr

    def python(self, *words: object) -> str:
        """Return what Python prints that ends well."""
        status, out, error = self._ended(sys.executable, *words)
        assert status == 0, f"{out}\n{error}"
        return out

    def said(self, *words: object) -> str:
        """Return what the command prints that ends well and has nothing to remark."""
        status, out, error = self._ended(*COMMAND, *words)
        assert (status, error) == (Status.OK, "")
        return out

    def done(self, *words: object) -> str:
        """Return what the command prints that ends well, and says how far it is meanwhile."""
        return self.python(*COMMAND[1:], *words)


@pytest.fixture
def elsewhere(tmp_path: Path) -> Elsewhere:
    return Elsewhere(tmp_path)


def test_what_linux_alone_has_is_hidden(elsewhere: Elsewhere) -> None:
    assert elsewhere.python("-c", HIDDEN) == "hidden\n"


def test_every_module_is_imported(elsewhere: Elsewhere) -> None:
    assert elsewhere.python("-c", IMPORTS) == "imported\n"


def test_a_run_in_virtual_time_is_recorded_replayed_and_shown(elsewhere: Elsewhere) -> None:
    elsewhere.said("check", "detective")
    words = ("--doubles", "--clock", "virtual", "--for", "5", "--record", "it.recording")
    elsewhere.said("run", "detective", *words, "--plot", "arena.svg", "--statistics", "it.stats")
    assert elsewhere.said("replay", "it.recording").startswith("identical: ")
    elsewhere.said("report", "it.stats", "-o", "report.html")
    elsewhere.said("debug", "it.recording", "--at", "2")
    elsewhere.said("export", "it.recording", "-o", "it.csv")
    elsewhere.said("show", "detective", "-o", "couplings.svg")
    written = {each.name for each in elsewhere.folder.iterdir()}
    assert {"arena.svg", "report.html", "it.csv", "couplings.svg"} <= written


def test_a_run_is_studied(elsewhere: Elsewhere) -> None:
    words = ("--doubles", "--clock", "virtual", "--for", "12", "--record", "it.recording")
    elsewhere.said("run", "tachobot", *words, "--set", "controller.mode='platform'")
    for verb in ("identify", "tune"):
        elsewhere.done(verb, "tachobot", "--from", "it.recording", "-o", f"{verb}.html")
    what_if = ("--set", "controller.yaw.kp=0.5", "-o", "what_if.html")
    assert "replayed: " in elsewhere.python(*COMMAND[1:], "replay", "it.recording", *what_if)
    for file in ("it.parquet", "it.mcap"):
        elsewhere.said("export", "it.recording", "-o", file)
    written = {each.name for each in elsewhere.folder.iterdir()}
    assert {"identify.html", "tune.html", "what_if.html", "it.parquet", "it.mcap"} <= written


def test_a_board_is_run_many_times_in_processes_of_their_own(elsewhere: Elsewhere) -> None:
    few = ("--runs", "3", "--for", "1", "--workers", "2")
    vary = ("--vary", "controller.yaw.kp=uniform(0.5, 1.0)")
    assert "3 runs: 3 ended" in elsewhere.done("sweep", "tachobot", *vary, *few, "-o", "it.csv")
    assert "the same as in the table" in elsewhere.done("sweep", "rerun", "it.csv", "0")
    assert elsewhere.done("campaign", "tachobot", *few, "-o", "faults.csv").startswith("3 of ")


@pytest.mark.real_time
def test_stages_of_one_process_are_certified_and_others_named(elsewhere: Elsewhere) -> None:
    said = elsewhere.done("continuity", "tachobot", "--for", "1", "-o", "it.html")
    for stage in ("simulation", "embedded"):
        assert f"{stage}, whole: identical: " in said
    for stage in ("network", "remote"):
        assert f"{stage}: not run: macOS lacks what this needs; expected Linux" in said


@pytest.mark.real_time
def test_a_run_in_real_time_keeps_statistics_and_is_its_replay(elsewhere: Elsewhere) -> None:
    elsewhere.said("run", "detective", "--doubles", "--for", "1")
    assert "ended after 1." in elsewhere.said("stats", "detective")
    assert "detective" in elsewhere.done("top", "detective")
    assert "detective" in elsewhere.said("recordings")
    elsewhere.said("report", "detective", "-o", "report.html")
    assert elsewhere.said("replay", "detective").startswith("identical: ")


def test_an_experiment_in_simulation_has_its_page(elsewhere: Elsewhere) -> None:
    words = ("mission", "detective", "--stage", "simulation", "-o", "out")
    elsewhere.python(*COMMAND[1:], "experiment", *words)
    assert any(elsewhere.folder.glob("out/**/*.html"))


def test_the_tests_of_a_robot_pass(elsewhere: Elsewhere) -> None:
    options = ("-q", "-p", "no:cacheprovider", "--rootdir", EXAMPLE, "-c", os.devnull)
    assert " passed" in elsewhere.python("-m", "pytest", *options, EXAMPLE / "tests")


REFUSED = {
    **{verb: [verb, "tachobot"] for verb in OF_LINUX},
    "bridge": ["bridge", "tachobot", "--listen", "127.0.0.1:0"],
    "doubles": ["doubles", "serve", "tachobot"],
    "gate": ["gate", "HEAD", "HEAD", "tachobot"],
    "probe": ["probe"],
    "send": ["send", "tachobot", "yaw_reference=1"],
    "service": ["service", "status", "tachobot"],
    "try": ["try", "mpu9250"],
    "watch": ["watch", "tachobot", "yaw_reference"],
    "run on chips": ["run", "tachobot"],
    "run on served doubles": ["run", "tachobot", "--doubles", "somewhere"],
    "run of two ends": ["run", "tachobot", "--stage", "network", "--for", "1", "--json"],
}


def test_what_needs_linux_says_so_in_a_line(elsewhere: Elsewhere) -> None:
    for words in json.loads(elsewhere.python("-c", EACH, json.dumps([*REFUSED.values()]))):
        line, status = words.pop("error"), words.pop("status")
        assert status == Status.BAD_INPUT, (words, line)
        assert "macOS lacks what this needs; expected Linux" in line, words
        assert line.count("\n") == 1, words
