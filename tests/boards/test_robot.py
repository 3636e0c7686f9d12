"""What every robot can do: be switched off, whatever goes wrong."""

from collections.abc import Callable

from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.hal.wire_errors import HalError


def test_a_defect_in_one_stop_does_not_keep_the_next_chip_on() -> None:
    stopped: list[str] = []

    def broken() -> None:
        raise ValueError("no such register")

    assert robot(broken, lambda: stopped.append("second")).make_safe() == [
        "ValueError: no such register"
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
