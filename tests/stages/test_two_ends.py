"""Both ends of a stage live and end together, whatever ends one of them."""

import os
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.lab.stages.two_ends import EndProcess, TwoEnds
from firmware_runtime.system.signals import until_signal
from tests.support.waiting import PATIENCE_S

PATIENCE = PATIENCE_S * SECOND

pytestmark = [pytest.mark.slow, pytest.mark.real_time]


class Ends:
    """Two runs that have nothing to do with each other, but that they end together."""

    def __init__(self, folder: Path, together: TwoEnds, said: list[str]) -> None:
        self.together, self.said = together, said
        self.one, self.other = (self._start(folder, name) for name in ("one", "other"))

    def _start(self, folder: Path, name: str) -> EndProcess:
        statistics = str(folder / f"{name}.stats")
        words = ("run", "tachobot", "--doubles", "--for", "600", "--statistics", statistics)
        end = EndProcess(name, words)
        self.together.add(end)
        return end

    def run(self) -> None:
        """Until both have reported."""
        both = (self.one, self.other)
        assert self.together.wait_until(lambda: all(end.report for end in both), PATIENCE)

    def wait(self) -> None:
        ended = self.together.ended
        assert self.together.wait_until(lambda: len(ended) == 2, PATIENCE)


@pytest.fixture
def ends(tmp_path: Path) -> Iterator[Ends]:
    with _ends(tmp_path) as made:
        yield made


@contextmanager
def _ends(folder: Path) -> Iterator[Ends]:
    said: list[str] = []
    with until_signal() as signalled:
        together = TwoEnds(signalled, said.append, lambda: None)
        try:
            yield Ends(folder, together, said)
        finally:
            together.close()


def pid_of(end: EndProcess) -> int:
    return end._process.pid


def test_a_report_says_how_an_end_fares(ends: Ends) -> None:
    ends.run()
    report = ends.one.report
    assert report["shown"] == "world.yaw_rad"
    assert report["armed"] is True
    assert {"now_ns", "began_ns", "overruns", "faults"} <= report.keys()


def test_the_death_of_one_end_ends_the_other_with_its_outputs_off(ends: Ends) -> None:
    ends.run()
    os.kill(pid_of(ends.one), signal.SIGKILL)
    ends.wait()
    assert [end.role for end in ends.together.ended] == ["one", "other"]
    assert ends.together.failed_first is ends.one
    assert (ends.one.status, ends.other.status) == (128 + 9, 143)
    assert ends.other.document()["outputs_on"] == {"thrust_pairs": 0}
    assert ends.one.document() == {}
    assert "one: ended by SIGKILL" in ends.said


def test_a_signal_is_handed_on_to_both(ends: Ends) -> None:
    ends.run()
    os.kill(os.getpid(), signal.SIGINT)
    ends.wait()
    assert ends.together.failed_first is None
    for end in (ends.one, ends.other):
        assert end.status == 130
        assert end.document()["outputs_on"] == {"thrust_pairs": 0}


def test_an_end_ends_when_what_started_it_has_gone(ends: Ends) -> None:
    ends.run()
    ends.one.reports.shutdown(socket.SHUT_RDWR)
    ends.wait()
    assert ends.one.status == 143
    assert ends.one.document()["ended"]["reason"] == "the process that started this end has gone"
    assert ends.one.document()["outputs_on"] == {"thrust_pairs": 0}
