"""A bus that is gone when a run ends: outputs go off once it is back, or status 4 says why.

That a second Ctrl-C gives up: `tests/executive/test_switching_off.py`.
"""

import signal
from pathlib import Path

import pytest

from tests.support.guarded_run import GuardedRun, guarded_run
from tests.support.waiting import PATIENCE_S, wait_until

pytestmark = pytest.mark.slow

SWITCH_OFF = ("--set", "executive.switch_off_s=5")


def outage(run: GuardedRun, lasts_s: float) -> None:
    """No chip answers from now on, for a while."""
    done = run.ask("doubles", "fault", "nack", "--for", lasts_s, "--socket", run.socket)
    assert done.returncode == 0, done.stderr


def ended(run: GuardedRun) -> int:
    """The run's exit status, once it has ended."""
    return run.run.wait(PATIENCE_S)


@pytest.mark.parametrize("robot", ["tachobot", "detective"])
def test_a_bus_that_comes_back_leaves_nothing_on(robot: str, tmp_path: Path) -> None:
    with guarded_run(tmp_path, robot=robot, guard=False, words=SWITCH_OFF) as run:
        outage(run, 0.6)
        run.signal(signal.SIGTERM)
        status = ended(run)
        # nothing writes to the chips any more; an MD25 that was stopped slows down for 25 ms
        wait_until(lambda: run.is_off, "all outputs are off", run.errors)
        assert status != 4
        assert "not made safe" not in run.errors()


def test_a_bus_that_stays_away_is_given_up_with_a_sentence(tmp_path: Path) -> None:
    words = ("--set", "executive.switch_off_s=0.1")
    with guarded_run(tmp_path, guard=False, words=words) as run:
        outage(run, 600)
        run.signal(signal.SIGTERM)
        assert ended(run) == 4
        assert "not made safe: i2c1" in run.errors()
        assert "given up" in run.errors()
