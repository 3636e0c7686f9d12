"""The operator of a script of faults: disarms a run on doubles, arms it again, reloads it."""

from typing import TYPE_CHECKING

from firmware_runtime.hal.spans import Spans

if TYPE_CHECKING:
    from firmware_runtime.executive.executive import Executive
    from firmware_runtime.runs.arming import Arming
    from firmware_runtime.runs.tuning import Tuning


class ScriptedOperator:
    """Does as its script says with a run, by a hook of the run, once it attends one."""

    def __init__(self) -> None:
        self._spans = Spans()
        """Ns of the run in which it is to be disarmed."""
        self._has_disarmed = False
        self._reloads: list[int] = []
        """Ns of the run at which its settings are to be taken up again."""
        self._executive: Executive | None = None
        self._arming: Arming | None = None
        self._tuning: Tuning | None = None

    def attend(self, executive: "Executive", arming: "Arming", tuning: "Tuning") -> None:
        """Do so with this run."""
        self._executive, self._arming, self._tuning = executive, arming, tuning
        executive.hooks.append(self)

    def disarm(self, at: int, until: int) -> None:
        """Keep it disarmed from an instant to another, which may be NEVER."""
        self._spans.add(at, until)

    def reload(self, at: int) -> None:
        """Have it take up its settings again, as they are, at an instant."""
        self._reloads.append(at)

    def end(self, at: int) -> None:
        """Let what has no end be over at an instant."""
        self._spans.end(at)

    def clear(self) -> None:
        """Do nothing of what is left."""
        self._spans.clear()
        self._reloads.clear()

    def between_steps(self, now: int, _left: int) -> None:
        """Disarm it, or arm it again; have it take up its settings."""
        assert self._executive is not None  # noqa: S101 -- it attends one
        assert self._arming is not None  # noqa: S101
        assert self._tuning is not None  # noqa: S101
        is_due = self._spans.have(now)
        if is_due and not self._has_disarmed:
            self._arming.disarm("its operator disarmed it")
        elif self._has_disarmed and not is_due:
            self._arming.is_wanted = True  # as soon as nothing speaks against it
        self._has_disarmed = is_due
        if any(at <= now for at in self._reloads):
            self._tuning.take_up(self._tuning.board.settings)
            self._reloads = [at for at in self._reloads if at > now]
        self._executive.poll_by(min([self._spans.next_change(now), *self._reloads]))
