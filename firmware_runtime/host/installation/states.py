"""The states of units, from systemd."""

from collections.abc import Mapping
from dataclasses import dataclass

from firmware_runtime.host.installation.programs import answer

_PROPERTIES = {
    "ActiveState": "active",
    "SubState": "sub",
    "ActiveEnterTimestamp": "since",
    "MainPID": "pid",
    "NRestarts": "restarts",
    "WatchdogUSec": "watchdog",
    "Result": "result",
    "UnitFileState": "enabled",
    "StatusText": "says",
}


@dataclass(frozen=True, slots=True)
class UnitState:
    """A unit, in systemd's own words; empty where it has none."""

    unit: str
    active: str
    sub: str
    since: str
    pid: int
    restarts: int
    watchdog: str
    result: str
    enabled: str
    says: str

    @property
    def is_active(self) -> bool:
        """Whether it runs and is ready, or is reading its settings again."""
        return self.active in {"active", "reloading"}


def state_of(unit: str) -> UnitState:
    """Query systemd. Raises StepFailed when it cannot be reached."""
    printed = answer(("systemctl", "show", unit, f"--property={','.join(_PROPERTIES)}"))
    return parse(unit, dict(line.partition("=")[::2] for line in printed.splitlines()))


def parse(unit: str, properties: Mapping[str, str]) -> UnitState:
    """A unit from what `systemctl show` prints, by name."""
    words = {name: properties.get(key, "") for key, name in _PROPERTIES.items()}
    pid, restarts = int(words.pop("pid") or 0), int(words.pop("restarts") or 0)
    return UnitState(unit=unit, pid=pid, restarts=restarts, **words)
