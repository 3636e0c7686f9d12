"""Where a recording goes: through a pipe to the process that writes its file.

In real time handing over never waits: what the pipe does not take is kept, up to `ROOM` bytes, and
what does not fit there is refused whole. In virtual time, where waiting costs nothing, it waits.
"""

import fcntl
import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from select import select
from typing import Final, Protocol

from firmware_runtime.errors import ConfigError
from firmware_runtime.part_recording import writer
from firmware_runtime.recording.file_kind import PART_MAGIC

ROOM: Final = 1 << 22
"""Bytes kept in the run at most, while the writer is behind."""
PIPE: Final = 1 << 20
TIMEOUT_S: Final = 10.0
"""Longest wait for the writer: for room in virtual time, for its end at the end."""


class Sink(Protocol):
    """Takes frames."""

    def take(self, frame: bytes) -> bool:
        """Take a frame whole; False if there is no room for it."""

    def close(self) -> str | None:
        """Finish; return what went wrong, if something did."""


class PipeSink:
    """A pipe into a writer's process. Raises ConfigError for a file that cannot be made."""

    def __init__(self, path: Path, *, waits: bool) -> None:
        self._path = path
        self._waits = waits
        self._kept = bytearray(PART_MAGIC)
        self._is_broken = False
        try:
            file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644)
        except OSError as error:
            fault = f"cannot be written ({error.strerror}), expected a file that can be made"
            raise ConfigError(str(path), [fault]) from error
        source, self._pipe = os.pipe2(os.O_CLOEXEC)
        try:
            self._writer = subprocess.Popen(  # noqa: S603 -- this project's own program
                [sys.executable, "-I", "-S", writer.__file__],
                stdin=source,
                stdout=file,
                stderr=subprocess.PIPE,
                start_new_session=True,
            )
        finally:
            os.close(source)
            os.close(file)
        os.set_blocking(self._pipe, False)
        with suppress(OSError):  # over the machine's limit: its default will do
            fcntl.fcntl(self._pipe, fcntl.F_SETPIPE_SZ, PIPE)

    @property
    def writer(self) -> int:
        """The number of the writer's process."""
        return self._writer.pid

    def take(self, frame: bytes) -> bool:
        """Take a frame whole; False if there is no room for it."""
        self._hand_over()
        if self._waits:
            self._wait_for_room(len(frame))
        if self._is_broken or (self._kept and len(self._kept) + len(frame) > ROOM):
            return False
        self._kept += frame
        self._hand_over()
        return True

    def close(self) -> str | None:
        """Hand over what is left, and wait for the writer; return what went wrong."""
        self._wait_for_room(ROOM)
        is_cut = bool(self._kept) and not self._is_broken
        os.close(self._pipe)
        try:
            _, said = self._writer.communicate(timeout=TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._writer.kill()
            self._writer.communicate()
            return f"{self._path}: the writer did not end; the recording may end early"
        if self._writer.returncode or is_cut:
            reason = said.decode(errors="replace").strip() or "its writer has ended"
            return f"{self._path}: the recording ends early ({reason}); expected room for all of it"
        return None

    def _hand_over(self) -> None:
        """Write what the pipe takes now."""
        while self._kept and not self._is_broken:
            try:
                del self._kept[: os.write(self._pipe, self._kept)]
            except BlockingIOError:
                return
            except OSError:  # the writer has ended: its file takes no more
                self._is_broken = True

    def _wait_for_room(self, size: int) -> None:
        while not self._is_broken and self._kept and len(self._kept) + size > ROOM:
            if not select((), [self._pipe], (), TIMEOUT_S)[1]:
                return
            self._hand_over()
