"""Files that `run` leaves: `--trace`, begun before the run, and `--record`.

They are ended once the hardware is released: a disk that is slow holds up no bus. What did not take
everything is said, and is a status of its own, below any of the run.
"""

from contextlib import AbstractContextManager, ExitStack
from importlib import import_module
from pathlib import Path

from firmware_runtime.errors import Status, TraceNotWholeError
from firmware_runtime.runs.progress_line import Messages
from firmware_runtime.runs.session import Session


class RunFiles:
    """The files of one run."""

    def __init__(self, messages: Messages) -> None:
        self._messages = messages
        self._open = ExitStack()
        self._status = Status.OK

    def begin(self, session: Session, trace: Path | None, record: Path | None) -> None:
        """Begin those that are named. Raises TraceFileError."""
        if record is not None:
            self._open.callback(self._keep, session, record)
        if trace is not None:
            self._open.enter_context(_tracing(session, trace))

    def close(self) -> Status:
        """End them; return whether they took everything."""
        try:
            self._open.close()
        except TraceNotWholeError as error:
            self._not_whole(str(error))
        return self._status

    def _keep(self, session: Session, into: Path) -> None:
        fault = session.edge.keep_into(into)
        if fault is not None:
            self._not_whole(f"--record {fault}")

    def _not_whole(self, sentence: str) -> None:
        self._status = Status.NOT_PRINTED
        self._messages(sentence)


def _tracing(session: Session, path: Path) -> AbstractContextManager[None]:
    """Write a trace: in virtual time as the run goes, in real time of its recording, afterwards.

    What is not recorded is kept in memory until then. Only what is needed is imported.
    """
    waits = session.executive.clock.speed != 0
    if waits and session.edge.recorder is not None:
        recorded = import_module("firmware_runtime.runs.trace_of_run")
        of_recording: AbstractContextManager[None] = recorded.traced_by_recording(session, path)
        return of_recording
    live = import_module("firmware_runtime.statistics.trace_file")
    tracing: AbstractContextManager[None] = live.tracing(
        session.executive.simulator, path, at_end=waits
    )
    return tracing
