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
CHANGED = "it was reset or written to by another program"


def write(run: GuardedRun, address: int, message: bytes) -> None:
    """What another program, or the chip's supply, does to it."""
    connection = Connection(run.socket, answer_s=PATIENCE_S)
    ServedBus("i2c1", connection.ask).write(address, message)
    connection.close()


def was_off(run: GuardedRun, since: int) -> bool:
    """Whether every output was off at some instant of the log from that line on."""
    outputs: dict[str, float] = {}
    for number, line in enumerate(run.lines()):
        if "output" in line:
            outputs[line["output"]] = line["value"]
            if number >= since and not any(outputs.values()):
                return True
    return False


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


@pytest.mark.parametrize(
    ("address", "message"),
    [(GENERAL_CALL, RESET), (PWM, INVERTED), (PWM, WAITS_FOR_FOUR_REGISTERS)],
)
def test_what_it_changes_is_noticed_said_and_leaves_nothing_on(
    tmp_path: Path, address: int, message: bytes
) -> None:
    with guarded_run(tmp_path, guard=False) as run:  # it is the run that notices
        before = len(run.lines())
        write(run, address, message)
        wait_until(lambda: was_off(run, before), "it has been switched off", run.errors)
        # On a busy machine forces that came late may have switched it off before that.
        wait_until(
            lambda: CHANGED in run.ask("stats", "tachobot").stdout, "the run says so", run.errors
        )
        wait_until(lambda: not run.is_off, "the run has brought it up again", run.errors)
        run.signal(signal.SIGTERM)
        run.run.wait(PATIENCE_S)
        assert run.is_off
