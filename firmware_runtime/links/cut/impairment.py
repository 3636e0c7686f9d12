"""Impairment of a network: delay, jitter, loss, reordering, duplication; by a seed.

    delay=40ms,jitter=10ms,loss=2%,reorder=1%,duplicate=0.5%,seed=1

Each way has the same, as with `tc netem`: a loop of out and back takes twice the delay. Jitter is
uniform about the delay, so datagrams that follow each other closely may change places; one that is
reordered is sent at once. What happens to the n-th datagram of a way depends on the seed, the way
and n alone.
"""

import re
from dataclasses import dataclass, fields
from random import Random
from typing import Any, Final, Literal, TypeAlias

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError, did_you_mean

Way: TypeAlias = Literal["out", "back"]
"""Out: from the controller to the robot."""

OPTION: Final = "--impair"
_UNITS: Final = {"us": MICROSECOND, "ms": MILLISECOND, "s": SECOND}
_LONGEST: Final = 10 * SECOND
_HIGHEST_SEED: Final = (1 << 53) - 1
_NUMBER: Final = r"([0-9]+\.?[0-9]*(?:e[+-]?[0-9]+)?|\.[0-9]+)"


@dataclass(frozen=True, slots=True)
class Impairment:
    """Impairment of a path: spans in ns, the others as shares of all datagrams."""

    delay: int = 0
    jitter: int = 0
    loss: float = 0.0
    reorder: float = 0.0
    duplicate: float = 0.0
    seed: int = 1

    def __str__(self) -> str:
        """Write it as the option has it, without what is zero."""
        words = [
            f"{name}={span / MILLISECOND:g}ms"
            for name, span in (("delay", self.delay), ("jitter", self.jitter))
            if span > 0
        ]
        words += [
            f"{name}={share * 100:g}%"
            for name in ("loss", "reorder", "duplicate")
            if (share := getattr(self, name)) > 0
        ]
        return ",".join([*words, f"seed={self.seed}"])


def impairment(text: str) -> Impairment:
    """Read the option. Raises ConfigError with every fault in it."""
    faults: list[str] = []
    values: dict[str, Any] = {}
    for word in filter(None, text.split(",")):
        name, _, value = word.partition("=")
        if name in values:
            faults.append(f"{name}: given twice; expected it once")
        try:
            values[name] = _value(name, value)
        except ValueError as error:
            faults.append(str(error))
    if not values and not faults:
        faults.append(f"{text!r}: expected some of {', '.join(_NAMES)}")
    if values.get("jitter", 0) > values.get("delay", 0):
        faults.append("jitter: more than the delay; expected as much at most")
    if faults:
        raise ConfigError(OPTION, faults)
    return Impairment(**values)


_NAMES: Final = [field.name for field in fields(Impairment)]


class Decisions:
    """Decides what happens to the datagrams of one way, one after the other."""

    def __init__(self, impairment: Impairment, way: Way) -> None:
        self._impairment = impairment
        self._random = Random(f"{impairment.seed} {way}")  # noqa: S311 -- repeatable, no secret

    def next(self) -> tuple[int, ...]:
        """The next datagram's delay, ns: none where it is lost, two where there are two of it."""
        how = self._impairment
        lost, at_once, twice, first, second = (self._random.random() for _ in range(5))
        if lost < how.loss:
            return ()
        delay = 0 if at_once < how.reorder else self._delay(first)
        return (delay, self._delay(second)) if twice < how.duplicate else (delay,)

    def _delay(self, drawn: float) -> int:
        how = self._impairment
        return how.delay + round((2 * drawn - 1) * how.jitter)


def _value(name: str, text: str) -> float:
    """Return one value, in ns, as a share, or the seed. Raises ValueError, with the fault."""
    if name in {"delay", "jitter"}:
        found = re.fullmatch(rf"{_NUMBER}(us|ms|s)", text)
        if found and (span := round(float(found[1]) * _UNITS[found[2]])) <= _LONGEST:
            return span
        raise ValueError(f"{name}: {text!r}: expected a span such as 80ms, 10s at most")
    if name in {"loss", "reorder", "duplicate"}:
        found = re.fullmatch(rf"{_NUMBER}%", text)
        if found and (share := float(found[1]) / 100) <= 1:
            return share
        raise ValueError(f"{name}: {text!r}: expected a share such as 2%")
    if name == "seed":
        if re.fullmatch("[0-9]+", text) and int(text) <= _HIGHEST_SEED:
            return int(text)
        raise ValueError(f"seed: {text!r}: expected a whole number below 2^53")
    like = did_you_mean(name, _NAMES)
    raise ValueError(f"{name!r}: expected some of {', '.join(_NAMES)}{like}")
