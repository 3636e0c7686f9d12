"""The delay of a loop: rounds of a ramp as the two ends traced them, and their figures."""

import json
from collections.abc import Iterable, Sequence
from math import ceil
from pathlib import Path

from msgspec import Struct

from firmware_runtime.devs.time import SECOND
from firmware_runtime.lab.experiments.loop_model import BACK, ECHOED, SENT


class Round(Struct, frozen=True):
    """One value of the ramp: when it was sent, sent back, and there again, s; None: never."""

    value: float
    sent_s: float
    echoed_s: float | None
    back_s: float | None

    @property
    def delay_ms(self) -> float | None:
        """From sent to back."""
        return None if self.back_s is None else (self.back_s - self.sent_s) * 1e3

    @property
    def out_ms(self) -> float | None:
        """From sent to the other end."""
        return None if self.echoed_s is None else (self.echoed_s - self.sent_s) * 1e3

    @property
    def return_ms(self) -> float | None:
        """From the other end back."""
        if self.echoed_s is None or self.back_s is None:
            return None
        return (self.back_s - self.echoed_s) * 1e3


class Delays(Struct, frozen=True):
    """What became of a ramp's values; times in ms, None where nothing came back."""

    sent: int
    back: int
    p50_ms: float | None
    p99_ms: float | None
    least_ms: float | None
    most_ms: float | None
    out_p50_ms: float | None
    """From the instant at which a value was due, to the other end."""
    return_p50_ms: float | None


def rounds_of(trace: Path, since_s: float) -> list[Round]:
    """The rounds that began at `since_s` or later, in order, out of a merged trace."""
    when: dict[str, dict[float, float]] = {SENT: {}, ECHOED: {}, BACK: {}}
    with trace.open() as file:
        for line in file:
            message = json.loads(line)
            if (found := when.get(message["port"])) is not None:
                found.setdefault(message["value"], message["t_ns"] / SECOND)
    return [
        Round(value, sent_s, when[ECHOED].get(value), when[BACK].get(value))
        for value, sent_s in sorted(when[SENT].items())
        if sent_s >= since_s
    ]


def first_back_s(rounds: Sequence[Round]) -> float:
    """When the first value that came back was sent: before that the link was not up."""
    return next((each.sent_s for each in rounds if each.back_s is not None), 0.0)


def delays_of(rounds: Sequence[Round]) -> Delays:
    """Their figures."""
    delays = _sorted(each.delay_ms for each in rounds)
    return Delays(
        sent=len(rounds),
        back=len(delays),
        p50_ms=quantile(delays, 0.5),
        p99_ms=quantile(delays, 0.99),
        least_ms=delays[0] if delays else None,
        most_ms=delays[-1] if delays else None,
        out_p50_ms=quantile(_sorted(each.out_ms for each in rounds), 0.5),
        return_p50_ms=quantile(_sorted(each.return_ms for each in rounds), 0.5),
    )


def _sorted(values: Iterable[float | None]) -> list[float]:
    return sorted(each for each in values if each is not None)


def quantile(ordered: Sequence[float], share: float) -> float | None:
    """The least value that at least this share does not pass; None of nothing."""
    if not ordered:
        return None
    return ordered[max(ceil(share * len(ordered)), 1) - 1]
