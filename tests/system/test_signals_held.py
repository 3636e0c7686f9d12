"""A signal that comes while a process is started waits until the start is whole."""

import signal

import pytest

from firmware_runtime.system.signals import exit_on_signals, signals_held


def held(number: signal.Signals, steps: list[str]) -> None:
    before = signal.getsignal(number)
    try:
        with signals_held():
            signal.raise_signal(number)
            steps.append("the block went on")
    finally:
        assert signal.getsignal(number) is before
        steps.append("and was left by the signal")


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_it_is_handled_at_the_end_of_the_block(number: signal.Signals, status: int) -> None:
    steps: list[str] = []
    with exit_on_signals(), pytest.raises(SystemExit) as ended:
        held(number, steps)
    assert (ended.value.code, len(steps)) == (status, 2)


def test_without_a_signal_nothing_happens() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with signals_held():
        assert signal.getsignal(signal.SIGTERM) is not before
    assert signal.getsignal(signal.SIGTERM) is before
