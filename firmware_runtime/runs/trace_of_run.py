"""The trace of a run in real time, made of its recording once it is over.

While the run goes on nothing is written: what leaves a port is in the recording anyway.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from firmware_runtime.errors import ConfigError, TraceNotWholeError, text_of
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.exports.observed_run import missing_in, moments_of
from firmware_runtime.runs.session import Session
from firmware_runtime.statistics.trace_file import TraceFile


@contextmanager
def traced_by_recording(session: Session, path: Path) -> Iterator[None]:
    """After the block, write what left every port in a session's run that is over and closed.

    Raises TraceFileError for a file that cannot be made, TraceNotWholeError for a trace that is
    not whole.
    """
    with TraceFile(path) as file:
        yield
        if not session.executive.has_begun:
            return
        try:
            missing = _write(session, file)
        except ConfigError as error:
            missing = [text_of(error)]
        if missing:
            raise TraceNotWholeError(f"the trace is not whole: {'; '.join(missing)}", where=path)


def _write(session: Session, file: TraceFile) -> list[str]:
    """Write it; returns what is missing in it, one sentence each."""
    if session.edge.kept is None:
        return ["the run could not be recorded"]
    recording = read_recording(session.edge.kept)
    for moment in moments_of(recording, session.board):
        for each in moment.sent:
            file.write(*each)
    return missing_in(recording)
