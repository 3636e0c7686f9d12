"""What every robot can do: be switched off, and stand in the statistics model by model."""

from collections.abc import Callable

import pytest

from firmware_runtime.board import registry
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.metrics import exposition
from firmware_runtime.statistics.run_text import statistics_text
from firmware_runtime.statistics.summary import summary
from firmware_runtime.view.page import page_of
from firmware_runtime.view.report.report import report


@pytest.mark.parametrize("kind", [ValueError, SystemExit, KeyboardInterrupt])
def test_a_defect_in_one_stop_does_not_keep_the_next_chip_on(kind: type[BaseException]) -> None:
    stopped: list[str] = []

    def broken() -> None:
        raise kind("no such register")

    assert robot(broken, lambda: stopped.append("second")).make_safe() == [
        f"{kind.__name__}: no such register"
    ]
    assert stopped == ["second"]


def test_an_error_without_words_does_not_keep_the_next_chip_on() -> None:
    class Unprintable(HalError):
        def __str__(self) -> str:
            raise ValueError("no words")

    stopped: list[str] = []

    def broken() -> None:
        raise Unprintable

    (failed,) = robot(broken, lambda: stopped.append("second")).make_safe()
    assert "Unprintable" in failed
    assert stopped == ["second"]


def robot(*stop: Callable[[], None]) -> Robot:
    return Robot(
        model=Coupled("robot"),
        probe=(),
        stop=stop,
        result=dict,
        ended=None,
        ends_on_failure=True,
        retune=lambda _: None,
        warnings=(),
    )


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective"])
def test_every_atomic_stands_in_the_statistics_the_text_the_page_and_the_metrics(
    board: str,
) -> None:
    """A TachoBot's IMU is activated 201 times in 2 s, and the detective reports events alone."""
    loaded = registry.load(board)
    session = start_session(loaded, VirtualClock(), doubles=True, statistics_path=None)
    try:
        assert session.executive.run(2 * SECOND).error is None
    finally:
        session.close()
    paths = [below_root(atomic.path) for atomic in session.executive.simulator.atomics]
    statistics = session.executive.statistics
    found = statistics.figures()
    assert list(found.models) == paths
    text = "\n".join(statistics_text(found))
    shown = page_of(report(statistics, summary(found)))
    metrics = exposition(board, statistics)
    for path in paths:
        assert path in text
        assert f'"{path}"' in shown
        assert f'model="{path}"' in metrics
    assert found.scheduled == found.run + found.skipped + found.coalesced > 50
    if board == "detective":
        assert {model.kind for model in found.models.values()} == {"event"}
        assert found.models["body_compass"].run > 0
        assert summary(found).startswith(f"{found.scheduled} events virtual time")
    else:
        imu = statistics.as_json()["models"]["imu"]
        assert (imu["kind"], imu["scheduled"], imu["irregular"]) == ("periodic", 201, 0)
