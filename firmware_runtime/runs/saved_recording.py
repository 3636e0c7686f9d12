"""The recording of a run that is over, written into a file of its own.

Imported only by runs whose recording is to be kept so.
"""

from pathlib import Path

from firmware_runtime.errors import ConfigError, text_of
from firmware_runtime.recording.blackbox.chunk_file import used_of
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.system.atomic_file import keep_file


def keep_recording(path: Path | None, into: Path) -> str | None:
    """Write what is used of the recording at `path`; return why it could not be, a sentence.

    Call it once the hardware is released: it may be slow. The path is None if there is none.
    """
    if path is None:
        return f"{into}: nothing of this run was recorded"
    try:
        keep_file(into, used_of(read_recording(path)))
    except (OSError, ConfigError) as error:
        why = (isinstance(error, OSError) and error.strerror) or text_of(error)
        return f"{into}: the recording cannot be kept there ({why}); it is in {path}"
    return None
