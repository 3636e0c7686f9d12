"""A chip that another program wrote to, or that was reset: every end is full-off all the same."""

import signal
from pathlib import Path

import pytest

from firmware_runtime.hal.i2c import GENERAL_CALL
from firmware_runtime.hal.served.client import ServedBus
from firmware_runtime.hal.served.connection import Connection
from tests.support.guarded_run import GuardedRun, guarded_run, wait_until
from tests.support.waiting import PATIENCE_S

pytestmark = pytest.mark.slow
PWM = 0x40
INVERTED, WAITS_FOR_FOUR_REGISTERS = b"\x01\x14", b"\x01\x0c"
RESET = b"\x06"


def write(run: GuardedRun, address: int, message: bytes) -> None:
    """What another program, or the chip's supply, does to it."""
    connection = Connection(run.socket)
    ServedBus("i2c1", connection.ask).write(address, message)
    connection.close()


@pytest.mark.parametrize("mode2", [INVERTED, WAITS_FOR_FOUR_REGISTERS])
@pytest.mark.parametrize("end", ["SIGTERM", "SIGKILL", "safe-state"])
def test_no_end_leaves_on_what_full_off_alone_would_not_stop(
    tmp_path: Path, mode2: bytes, end: str
) -> None:
    with guarded_run(tmp_path) as run:
        write(run, PWM, mode2)
        if end == "safe-state":
            assert "all outputs off" in run.safe_state("requested")
        else:
            run.signal(signal.Signals[end])
            run.run.wait(PATIENCE_S)
            wait_until(lambda: run.is_off, "the guard has switched off", run.errors)
        assert run.is_off


def test_a_reset_is_noticed_said_and_leaves_nothing_on(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        write(run, GENERAL_CALL, RESET)
        wait_until(lambda: run.is_off, "the chip is as after power-up")
        wait_until(lambda: not run.is_off, "the run has brought it up again", run.errors)
        said = run.ask("stats", "tachobot").stdout
        assert "it was reset or written to by another program" in said
        run.signal(signal.SIGTERM)
        run.run.wait(PATIENCE_S)
        assert run.is_off
