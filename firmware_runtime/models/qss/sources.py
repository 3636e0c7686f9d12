"""Sources: constant, step, ramp, pulse, square wave, sine, and samples from a file.

All but the sine are exact. Instants and durations are in seconds from the start of the run, the
units of values are the signal's.
"""

import csv
from collections.abc import Sequence
from itertools import pairwise
from math import inf, isfinite, nan
from pathlib import Path
from typing import TypeAlias

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.devs.time import seconds as whole_ns
from firmware_runtime.models.qss.segment import ZERO_SEGMENT, Segment

Planned: TypeAlias = tuple[float, Segment]
"""An instant in s, and the segment that begins there."""


class Schedule(Atomic):
    """Sends segments at instants known beforehand: `planned`, in order of time, from 0 on.

    sending (0) --out!--> waiting (until the next) --> sending
    """

    def __init__(self, name: str, planned: Sequence[Planned] = ()) -> None:
        super().__init__(name)
        instants = [at_s for at_s, _ in planned]
        is_in_order = instants == sorted(set(instants))
        if not (is_in_order and all(0.0 <= each < inf for each in instants)):
            raise ModelError("expected instants of 0 s or more, each after the last", where=name)
        self.out = self.out_port("out", Segment)
        self._planned = [(whole_ns(at_s), segment) for at_s, segment in planned]
        self._number = 0
        self._at = 0
        self._next = (0, ZERO_SEGMENT)

    def initialize(self) -> None:
        """Take the first of its segments."""
        self._at = self._number = 0
        self._take()

    def output(self) -> None:
        """Send the segment that begins now."""
        self.out.send(self._next[1])

    def internal(self) -> None:
        """Wait for the next."""
        self._at = self._next[0]
        self._take()

    def _take(self) -> None:
        self._next = self._segment(self._number) or (NEVER, ZERO_SEGMENT)
        if not all(map(isfinite, self._next[1])):
            raise ModelError(f"sends {self._next[1]}", where=self.path, expected="finite numbers")
        self._number += 1
        self.sigma = NEVER if self._next[0] >= NEVER else self._next[0] - self._at

    def _segment(self, number: int) -> tuple[int, Segment] | None:
        """The segment of a number, from 0; None after the last.

        A generator would be shorter, but where it stands cannot be kept with a recording.
        """
        return self._planned[number] if number < len(self._planned) else None


def _from(at_s: float, before: float, *planned: Planned) -> list[Planned]:
    """Return what is planned, from an instant on, and `before` until then."""
    return [*([(0.0, Segment(before))] if at_s > 0.0 else []), *planned]


class Step(Schedule):
    """`before` until `at_s`, `after` from then on."""

    def __init__(
        self, name: str, at_s: float = 0.0, *, before: float = 0.0, after: float = 1.0
    ) -> None:
        super().__init__(name, _from(at_s, before, (at_s, Segment(after))))


class Constant(Step):
    """One value for good."""

    def __init__(self, name: str, value: float) -> None:
        super().__init__(name, after=value)


class Ramp(Schedule):
    """`start` until `at_s`, then with `slope`, a unit a second, until `until_s` if it is given."""

    def __init__(
        self,
        name: str,
        slope: float,
        *,
        at_s: float = 0.0,
        until_s: float | None = None,
        start: float = 0.0,
    ) -> None:
        planned = [(at_s, Segment(start, slope))]
        if until_s is not None:
            planned.append((until_s, Segment(start + slope * (until_s - at_s))))
        super().__init__(name, _from(at_s, start, *planned))


class Pulse(Schedule):
    """`high` for `duration_s` from `at_s` on, `low` before and after."""

    def __init__(
        self, name: str, at_s: float, duration_s: float, *, low: float = 0.0, high: float = 1.0
    ) -> None:
        pulse = (at_s, Segment(high)), (at_s + duration_s, Segment(low))
        super().__init__(name, _from(at_s, low, *pulse))


class Square(Schedule):
    """`high` for the share `duty` of each period, from its beginning, then `low`."""

    def __init__(
        self,
        name: str,
        period_s: float,
        *,
        duty: float = 0.5,
        low: float = 0.0,
        high: float = 1.0,
    ) -> None:
        super().__init__(name)
        if not 4e-9 <= period_s < inf:
            raise ModelError(f"period_s is {period_s!r}", where=name, expected="4e-9 or more")
        if not 0.0 <= duty <= 1.0:
            raise ModelError(f"duty is {duty!r}", where=name, expected="0 to 1")
        self._period, self._on = period_s * SECOND, duty * period_s * SECOND
        self._in_a_period = [(0.0, Segment(high))] if self._on >= 1.0 else []
        if self._on < self._period - 1.0:
            self._in_a_period.append((self._on, Segment(low)))

    def _segment(self, number: int) -> tuple[int, Segment] | None:
        periods, place = divmod(number, len(self._in_a_period))
        after, segment = self._in_a_period[place]
        return round(periods * self._period + after), segment


class Samples(Schedule):
    """Values at instants: straight lines between them, or each held until the next (`holds`).

    The first value holds from the start, the last one to the end.
    """

    def __init__(
        self, name: str, samples: Sequence[tuple[float, float]], *, holds: bool = False
    ) -> None:
        if not samples:
            raise ModelError("0 samples", where=name, expected="1 or more")
        planned = [
            (
                at_s,
                Segment(
                    value, 0.0 if holds or next_s == at_s else (after - value) / (next_s - at_s)
                ),
            )
            for (at_s, value), (next_s, after) in pairwise(samples)
        ]
        first, last = samples[0], samples[-1]
        super().__init__(name, _from(*first, *planned, (last[0], Segment(last[1]))))


class FromFile(Samples):
    """Samples from a CSV file: seconds and value in the first two columns, a header or none."""

    def __init__(self, name: str, path: Path | str, *, holds: bool = False) -> None:
        super().__init__(name, _read(Path(path)), holds=holds)


def _read(path: Path) -> list[tuple[float, float]]:
    try:
        rows = [row for row in csv.reader(path.read_text("utf-8").splitlines()) if row]
    except UnicodeDecodeError as error:
        raise ModelError("cannot be read: not UTF-8", where=path, expected="a CSV file") from error
    except (OSError, csv.Error) as error:
        why = getattr(error, "strerror", None) or error
        raise ModelError(f"cannot be read ({why})", where=path, expected="a CSV file") from error
    samples = []
    for number, row in enumerate(rows):
        try:
            at_s, value = float(row[0]), float(row[1])
        except (ValueError, IndexError):
            if number == 0:
                continue
            at_s = value = nan
        if not (isfinite(at_s) and isfinite(value)):
            line = f"{path}: line {number + 1} is {','.join(row)!r}"
            raise ModelError(line, expected="seconds and a value")
        samples.append((at_s, value))
    return samples
