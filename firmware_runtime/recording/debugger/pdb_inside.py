"""An ordinary debugger (pdb) within a function of a model."""

import pdb  # noqa: T100 -- it is what is asked for
from collections.abc import Callable
from types import CodeType, FrameType
from typing import Any, TextIO

from firmware_runtime.recording.debugger.debugger import Ended


class PdbInside:
    """Calls a function under pdb, which stops where the model's own code begins.

    Between it and the model may be functions of the executive, which pdb passes. `continue` goes
    back to the recording, `quit` leaves both.
    """

    def __init__(self, commands: TextIO | None, output: TextIO | None) -> None:
        self._streams = commands, output

    def __call__(
        self, function: Callable[..., None], own: object, arguments: tuple[object, ...]
    ) -> None:
        """Call it; `own` is the model's function within it."""
        commands, output = self._streams
        debugger = _Pdb(getattr(own, "__code__", None), stdin=commands, stdout=output)
        if commands is not None:
            debugger.use_rawinput = False

        def call() -> None:  # a frame around it: pdb does not stop where the outermost begins
            function(*arguments)

        debugger.runcall(call)


class _Pdb(pdb.Pdb):
    """Stops for the first time where some code begins."""

    def __init__(self, code: CodeType | None, **streams: Any) -> None:  # noqa: ANN401 -- pdb's
        super().__init__(nosigint=True, readrc=False, **streams)
        self.prompt = "(Pdb) "
        self._code = code
        self._is_inside = code is None

    def stop_here(self, frame: FrameType) -> bool:
        """Return whether to stop in a frame."""
        if not self._is_inside:
            if frame.f_code is not self._code:
                return False
            self._is_inside = True
            return True
        return bool(super().stop_here(frame))

    def do_quit(self, arg: str) -> bool | None:
        """Leave the debugger of the recording too."""
        del arg
        raise Ended

    do_q = do_exit = do_quit
