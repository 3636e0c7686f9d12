"""The operator of a script of faults: disarms a run on doubles, and arms it again."""

from typing import TYPE_CHECKING

from firmware_runtime.devs.time import NEVER

if TYPE_CHECKING:
    from firmware_runtime.executive.executive import Executive
    from firmware_runtime.runs.arming import Arming


class ScriptedOperator:
    """Keeps a run disarmed as its script says, by a hook of the run, once it attends one."""

    def __init__(self) -> None:
        self._spans: list[tuple[int, int]] = []
        """Ns of the run from which and until which it is to be disarmed."""
        self._has_disarmed = False
        self._executive: Executive | None = None
        self._arming: Arming | None = None

    def attend(self, executive: "Executive", arming: "Arming") -> None:
        """Do so with this run."""
        self._executive, self._arming = executive, arming
        executive.hooks.append(self)

    def disarm(self, at: int, until: int) -> None:
        """Keep it disarmed from an instant to another, which may be NEVER."""
        self._spans.append((at, until))

    def end(self, at: int) -> None:
        """Let what has no end be over at an instant."""
        self._spans = [(begin, at if until == NEVER else until) for begin, until in self._spans]

    def clear(self) -> None:
        """Disarm it no more."""
        self._spans.clear()

    def between_steps(self, now: int, _left: int) -> None:
        """Disarm it, or arm it again."""
        assert self._executive is not None  # noqa: S101 -- it attends one
        assert self._arming is not None  # noqa: S101
        is_due = any(begin <= now < until for begin, until in self._spans)
        if is_due and not self._has_disarmed:
            self._arming.disarm("its operator disarmed it")
        elif self._has_disarmed and not is_due:
            self._arming.is_wanted = True  # as soon as nothing speaks against it
        self._has_disarmed = is_due
        self._executive.poll_by(
            min((at for span in self._spans for at in span if at > now), default=NEVER)
        )
