"""True state of a world whose doubles are served: requested from them, never from the run."""

from contextlib import suppress
from pathlib import Path

from firmware_runtime.hal.served.client import look
from firmware_runtime.hal.served.connection import Connection
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.system.resources import Closing


class Truth(Closing):
    """Asks the doubles at a path; where they have gone it says nothing any more."""

    def __init__(self) -> None:
        self._path: str | None = None
        self._connection: Connection | None = None

    def close(self) -> None:
        """Disconnect."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def values(self, path: str | None) -> dict[str, object]:
        """Return the values of the world's probe by its ports; empty where there is none."""
        if path != self._path:
            self.close()
            self._path = path
            if path is not None:
                with suppress(HalError):
                    self._connection = Connection(Path(path))
        if self._connection is None:
            return {}
        try:
            return look(self._connection.ask).truth
        except HalError:
            self.close()
            return {}
