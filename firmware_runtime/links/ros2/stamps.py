"""Instants of a run as instants of ROS: by the machine's monotonic clock, to that of the system.

t_ns of the run --(the run says both)--> CLOCK_MONOTONIC --(measured here)--> system time
"""

from firmware_runtime.devs.time import SECOND

CLOCK_SET: int = SECOND
"""A stamp that would go back further than this follows: the system's clock was set."""
_NEARLY = 0.01


class Stamps:
    """Turns instants of one run into ns since 1970; `measure` is repeated once a second.

    In scaled time the pace of the run is found from two measurements.
    """

    def __init__(self) -> None:
        self._t_ns = self._monotonic_ns = self._to_system = 0
        self._pace = 1.0
        self._last: dict[str, int] = {}
        self._is_measured = False

    @property
    def is_known(self) -> bool:
        """Whether a run has said its time."""
        return self._is_measured

    def measure(self, t_ns: int, monotonic_ns: int, to_system: int) -> bool:
        """Take an instant of the run and of the monotonic clock, and what leads to system time.

        Return whether it is the run that was measured before.
        """
        since = t_ns - self._t_ns
        is_same = self._is_measured and since > 0
        if is_same:
            pace = (monotonic_ns - self._monotonic_ns) / since
            self._pace = 1.0 if abs(pace - 1.0) < _NEARLY else pace
        else:
            self._pace = 1.0
        self._t_ns, self._monotonic_ns, self._to_system = t_ns, monotonic_ns, to_system
        self._is_measured = True
        return is_same

    def forget(self) -> None:
        """The run is gone; the next has another beginning."""
        self._is_measured = False

    def of(self, topic: str, t_ns: int) -> int:
        """The stamp of a message of the run; a topic's stamps never go back."""
        passed = round((t_ns - self._t_ns) * self._pace)
        stamp = self._monotonic_ns + passed + self._to_system
        last = self._last.get(topic, stamp)
        if last - CLOCK_SET < stamp < last:
            stamp = last
        self._last[topic] = stamp
        return stamp
