"""Recordings that are written into a file of their own: of a start that failed, or on request.

Imported only by runs that are recorded, when they are over.
"""

from collections.abc import Callable
from pathlib import Path

from firmware_runtime.errors import ConfigError, text_of
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.recording.blackbox.layout import Chunk, file_of
from firmware_runtime.recording.blackbox.locations import failed_start_beside
from firmware_runtime.recording.blackbox.reader import kind_of, read_recording
from firmware_runtime.recording.blackbox.section import Kind, decode
from firmware_runtime.runs.black_box import encoded_header, header_of
from firmware_runtime.runs.hardware import RecordedRobot
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.system.atomic_file import OWN_AND_GROUP, keep_file, replace_file


def keep_failed_start(
    robot: RecordedRobot, recording: Path, error: BaseException, log: Callable[[str], None]
) -> None:
    """Keep what the chips were asked and answered, beside the recording of the last run.

    Nothing is kept if no chip was asked.

    `log` gets why it cannot be kept.
    """
    recorder, clock = robot.recorder, robot.executive.clock
    try:
        if not any(decode(each).transfers for each in recorder.before_the_run):
            return
        if kind_of(recorder.before_the_run[-1]) != Kind.ENDED:
            reason = text_of(error) or type(error).__name__
            recorder.finish(Outcome(RunState.FAILED, reason, error), clock.now())
        sections = [encoded_header(header_of(robot)), *recorder.before_the_run]
        recording.parent.mkdir(parents=True, exist_ok=True)
        content = file_of([Chunk(1, sections)])
        replace_file(failed_start_beside(recording), content, OWN_AND_GROUP)
    except Exception as worse:  # noqa: BLE001 -- why the start failed is what matters
        log(f"warning: this start is not recorded: {text_of(worse)}")


def keep_recording(path: Path | None, into: Path) -> str | None:
    """Write what is used of the recording at `path`; return why it could not be, a sentence.

    Call it once the hardware is released: it may be slow. The path is None if there is none.
    """
    if path is None:
        return f"{into}: nothing of this run was recorded"
    try:
        keep_file(into, file_of(read_recording(path).chunks))
    except (OSError, ConfigError) as error:
        why = (isinstance(error, OSError) and error.strerror) or text_of(error)
        return f"{into}: the recording cannot be kept there ({why}); it is in {path}"
    return None
