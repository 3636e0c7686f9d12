"""A command's own process collects no garbage of its start, and others' processes as ever."""

import gc
import subprocess
import sys

import pytest

from firmware_runtime.cli.main import main

SHOWS = """
import atexit, gc, sys
from firmware_runtime.cli import main as module
executed = module._executed
def shown(parsed):
    print("enabled", gc.isenabled(), "kept", gc.get_freeze_count() > 1000)
    return executed(parsed)
module._executed = shown
atexit.register(lambda: print("ends", gc.isenabled()))
sys.argv[1:] = ["show"]
sys.exit(module.main())
"""


LOADS = """
import gc, sys
from firmware_runtime.cli.commands import run
from firmware_runtime.cli.main import main
frozen, enabled = [], []
def seen(function):
    def load(*words):
        frozen.append(gc.get_freeze_count())
        enabled.append(gc.isenabled())
        return function(*words)
    return load
run.chosen_board, run._session = seen(run.chosen_board), seen(run._session)
sys.argv[1:] = "run tachobot --doubles --clock virtual --for 1.5".split()
main()
print("more frozen", frozen[1] - frozen[0] > 1000, "enabled", enabled)
"""


@pytest.mark.slow
def test_nor_is_what_a_run_goes_on_to_load() -> None:
    words = [sys.executable, "-c", LOADS]
    done = subprocess.run(words, check=True, capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "more frozen True enabled [False, False]"


@pytest.mark.slow
def test_what_a_start_makes_is_never_looked_through() -> None:
    done = subprocess.run([sys.executable, "-c", SHOWS], check=True, capture_output=True, text=True)
    lines = done.stdout.splitlines()
    assert lines[0] == "enabled True kept True"
    assert lines[-1] == "ends True"


def test_a_command_within_a_program_leaves_its_collection_alone(
    capsys: pytest.CaptureFixture[str],
) -> None:
    before = gc.get_freeze_count()
    assert main(["show"]) == 0
    assert "tachobot" in capsys.readouterr().out
    assert gc.isenabled()
    assert gc.get_freeze_count() == before
