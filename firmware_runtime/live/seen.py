"""What a page shows of a run, as a file for other programs: those ports, that stretch of time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.exports.run_file import check_stretch, mcap_content, table_content
from firmware_runtime.recording.replay.stretch import Stretch

ENDINGS: Final = ("csv", "parquet", "mcap")


def exported(
    recording: Path, ports: Sequence[str], begin_ns: int, until_ns: int, ending: str
) -> bytes:
    """The bytes of the file; of all ports if none is named, a field may be named behind one.

    Raises ConfigError, also where the extra that writes it is missing.
    """
    if ending not in ENDINGS:
        raise ConfigError.of_one(
            "export", repr(ending)[:40], expected=f"one of {', '.join(ENDINGS)}"
        )
    stretch = Stretch(begin_ns, until_ns)
    found = read_recording(recording)
    check_stretch(found, stretch)
    if ending == "mcap":
        return mcap_content(found, stretch, ports)
    return table_content(found, stretch, ports, f".{ending}")
