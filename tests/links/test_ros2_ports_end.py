"""The thread that reads a run's ports survives what no run says."""

from pathlib import Path

import pytest

from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.links.ros2 import ports_end
from firmware_runtime.links.ros2.ports_end import PortsEnd
from tests.support.replies import Replies
from tests.support.waiting import wait_until

TIME = b'{"t_ns": 1, "monotonic_ns": 1}'


@pytest.mark.parametrize("said", [b"\xff", b"5", b'{"monotonic_ns": {}}'])
def test_what_is_not_understood_is_counted_and_said_and_reading_goes_on(
    tmp_path: Path, said: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ports_end, "TIME_EVERY", 10 * MILLISECOND)
    logged: list[str] = []
    with Replies(tmp_path / "robot.stats") as run:
        end = PortsEnd(run.path, ["said"], lambda *_: None, logged.append)
        end.begin(lambda _: NEVER)
        run.answer_bytes(said)
        run.answer_bytes(TIME)
        wait_until(lambda: any("watch" in each for each in run.requests()), "it reads on")
        end.close()
    assert end.counts["failed"] == 1
    [sentence] = logged
    assert "not understood" in sentence
