"""Another process that answers for a run that hangs is not believed: outputs may be on."""

import signal
from pathlib import Path

import pytest

from firmware_runtime.errors import Status
from tests.links.test_robot_end import impostor
from tests.support.guarded_run import guarded_run
from tests.support.trials import TURNING

pytestmark = pytest.mark.slow
SEND = "send tachobot yaw_reference=1"


def test_a_process_in_the_place_of_a_run_that_hangs_disarms_nothing(tmp_path: Path) -> None:
    with guarded_run(tmp_path, guard=False, words=TURNING) as run:
        run.signal(signal.SIGSTOP)
        socket = tmp_path / "tachobot.socket"
        socket.unlink()
        with impostor(socket):
            for words in ("disarm tachobot", "arm", "set tachobot", SEND):
                done = run.ask(*words.split())
                assert done.returncode not in {Status.OK, Status.REFUSED}
                assert f"the run is process {run.run.pid}" in done.stderr
                assert "disarmed" not in done.stdout
        assert not run.is_off
