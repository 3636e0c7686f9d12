"""Files that `run` writes along: `--trace` and `--record`, begun before the run.

They are ended once the hardware is released: a disk that is slow holds up no bus. What did not take
everything is said, and is a status of its own, below any of the run.
"""

import argparse
from collections.abc import Callable
from contextlib import ExitStack
from importlib import import_module

from firmware_runtime.cli.progress_line import Messages
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.runs.session import Session
from firmware_runtime.statistics.errors import TraceEndsEarlyError
from firmware_runtime.status import Status


class RunFiles:
    """The files of one run; call `ended` with how that ended."""

    def __init__(self, messages: Messages) -> None:
        self.ended: Callable[[Outcome], None] = lambda _outcome: None
        self._messages = messages
        self._open = ExitStack()
        self._status = Status.OK

    def begin(self, session: Session, arguments: argparse.Namespace) -> None:
        """Begin those that are named. Raises ConfigError, TraceFileError."""
        if arguments.record is not None:
            # what records is imported only if there is something to record
            module = import_module("firmware_runtime.runs.recorded_run")
            recorded = module.recorded(session, arguments.record, self._not_whole)
            self.ended = self._open.enter_context(recorded)
        if arguments.trace is not None:
            # likewise
            module = import_module("firmware_runtime.statistics.trace_file")
            at_end = arguments.loop is not None
            trace = module.tracing(session.executive.simulator, arguments.trace, at_end=at_end)
            self._open.enter_context(trace)

    def close(self) -> Status:
        """End them; return whether they took everything."""
        try:
            self._open.close()
        except TraceEndsEarlyError as error:
            self._not_whole(str(error))
        return self._status

    def _not_whole(self, sentence: str) -> None:
        self._status = Status.NOT_PRINTED
        self._messages(sentence)
