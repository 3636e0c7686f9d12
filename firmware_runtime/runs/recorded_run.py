"""The recording of one run: begun before it, closed when it is over."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from firmware_runtime.board.ends import role_without_hardware
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.part_recording.of_board import cut_of, header_of
from firmware_runtime.part_recording.recorder import NO_AGES, Recorder
from firmware_runtime.part_recording.sink import PipeSink
from firmware_runtime.runs.session import Session
from firmware_runtime.system.other_processors import kept_off


class RecordedRun:
    """Records what enters and leaves a role's part in the run of a session, into a file.

    Without a role it is the one that the session plays, and in a whole model the one without
    hardware. Raises ConfigError for a role that the board has not, and a file that cannot be made.
    """

    def __init__(self, session: Session, path: Path, role: str | None = None) -> None:
        end = session.end_of_board
        role = role or (role_without_hardware(session.board) if end is None else end.role)
        executive, board, shown = session.executive, session.board, session.shown
        is_real_time = isinstance(executive.clock, MonotonicClock)
        cut = cut_of(board, role, session.robot.model)
        header = header_of(board, role, cut, executive.clock, None if shown is None else shown.path)
        with kept_off(board.settings.executive.cpus):
            sink = PipeSink(path, waits=not is_real_time)
        self._recorder = Recorder(
            executive.simulator,
            cut,
            header,
            sink,
            is_real_time=is_real_time,
            ages=NO_AGES if session.linked is None else session.linked.link.ages,
        )
        if shown is not None:
            self._recorder.show(shown)
        executive.hooks.append(self._recorder)
        self._retune = session.robot.retune
        session.robot = replace(session.robot, retune=self._retuned)
        self._is_closed = False

    def close(self, outcome: Outcome | None = None) -> str | None:
        """Record how the run ended; return what is wrong with the recording. Again does nothing."""
        if self._is_closed:
            return None
        self._is_closed = True
        if outcome is None:
            return self._recorder.close("failed", "the run did not begin")
        return self._recorder.close(outcome.state.name.lower(), outcome.reason)

    def _retuned(self, settings: Any) -> None:  # noqa: ANN401 -- the board's own class
        self._retune(settings)
        self._recorder.retuned(settings)


@contextmanager
def recorded(
    session: Session, path: Path, log: Callable[[str], None], role: str | None = None
) -> Iterator[Callable[[Outcome], None]]:
    """Record a session's run within the block; call what it yields with how the run ended.

    `log` gets what is wrong with the recording, a sentence. Raises ConfigError as `RecordedRun`.
    """
    recording = RecordedRun(session, path, role)
    outcomes: list[Outcome] = []
    try:
        yield outcomes.append
    finally:
        fault = recording.close(*outcomes[-1:])
        if fault is not None:
            log(f"warning: {fault}")
