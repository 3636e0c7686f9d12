"""Differences of outputs between changed code and a recording, as numbers and as curves.

An output is a port, a field of one, or what is written to a device. Values of one instant are
compared in the order in which they left.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import zip_longest
from typing import Any, Final

from msgspec import Struct

from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.values import numbers_in, pack

_MISSING: Final = object()


class OutputDifference(Struct):
    """Difference of one output; of what is no number only the counts are known."""

    count: int = 0
    """Values that differ, to the bit."""
    of: int = 0
    """Values that were compared."""
    max: float | None = None
    """The largest difference, in the output's unit; of a write, of a byte."""
    rms: float | None = None
    """Root of the mean square of the differences of all that were compared."""
    first_s: float | None = None
    recorded_only: int = 0
    """Values that the changed code did not send at that instant."""
    replayed_only: int = 0
    reach: float = 0.0
    """The largest recorded magnitude where it differed."""

    @property
    def weight(self) -> float:
        """Size of the difference, for an order: as a share of what was recorded."""
        return (self.rms or 0.0) / (self.reach or 1.0) + (self.recorded_only > 0)


class Curves(Struct):
    """Recorded and replayed values of an output over time, s."""

    recorded: list[tuple[float, float]]
    replayed: list[tuple[float, float]]


class Outputs:
    """Collects them, section by section; curves of those that are `drawn`."""

    def __init__(self, drawn: Collection[str] = ()) -> None:
        self.curves: dict[str, Curves] = {}
        self._drawn = drawn
        self._found: dict[str, OutputDifference] = {}
        self._squares: defaultdict[str, float] = defaultdict(float)
        self._compared: Counter[str] = Counter()
        self._devices: set[str] = set()

    @property
    def draws(self) -> bool:
        """True if some are drawn."""
        return bool(self._drawn)

    def same(self, names: Iterable[str]) -> None:
        """Values that left these ports are as they were."""
        self._compared.update(names)

    def compare(self, name: str, at: int, recorded: object, replayed: object) -> None:
        """Compare what left by an output."""
        self._compared[name] += 1
        if not self._drawn and pack(recorded) == pack(replayed):
            return
        before, after = dict(leaves(name, recorded)), dict(leaves(name, replayed))
        for leaf in before | after:
            was, now = before.get(leaf, _MISSING), after.get(leaf, _MISSING)
            if leaf in self._drawn:
                self._draw(leaf, at, was, now)
            if was is _MISSING or now is _MISSING or pack(was) != pack(now):
                self._differ(leaf, at, was, now)

    def compare_writes(
        self, name: str, at: int, recorded: Sequence[object], replayed: Sequence[object]
    ) -> None:
        """Compare transfers of one device, in order."""
        self._devices.add(name)
        for was, now in zip_longest(recorded, replayed, fillvalue=_MISSING):
            if was is _MISSING or now is _MISSING:
                self.missing(name, at, replayed=was is _MISSING)
                continue
            self._compared[name] += 1
            if was != now:
                self._differ_in_bytes(self._of(name, at), name, _written(was), _written(now))

    def missing(self, name: str, at: int, *, replayed: bool) -> None:
        """A value left on one side only."""
        found = self._of(name, at)
        if replayed:
            found.replayed_only += 1
        else:
            found.recorded_only += 1

    def results(self) -> dict[str, OutputDifference]:
        """All that differ, most first; devices after ports."""
        for name, found in self._found.items():
            found.of = self._compared_of(name)
            if found.max is not None:
                found.rms = math.sqrt(self._squares[name] / max(found.of, 1))
        order = sorted(
            self._found.items(), key=lambda each: (each[0] in self._devices, -each[1].weight)
        )
        return dict(order)

    @property
    def compared(self) -> int:
        """Number of outputs that left something on both sides."""
        return len(self._compared)

    def _compared_of(self, leaf: str) -> int:
        """Count the comparisons of the port that this is a field of."""
        name = leaf
        while name and name not in self._compared:
            name = name[: max(name.rfind("."), name.rfind("["), 0)]
        return self._compared[name]

    def _differ(self, name: str, at: int, was: object, now: object) -> None:
        found = self._of(name, at)
        found.count += 1
        if _is_number(was) and _is_number(now):
            apart = abs(float(now) - float(was))  # type: ignore[arg-type]
            if math.isfinite(apart):
                self._squares[name] += apart * apart
                found.max = max(found.max or 0.0, apart)
                found.reach = max(found.reach, abs(float(was)))  # type: ignore[arg-type]

    def _differ_in_bytes(self, found: OutputDifference, name: str, was: bytes, now: bytes) -> None:
        found.count += 1
        if len(was) == len(now) > 0:
            apart = [abs(one - other) for one, other in zip(was, now, strict=True)]
            self._squares[name] += sum(each * each for each in apart) / len(apart)
            found.max = max(found.max or 0.0, *map(float, apart))
            found.reach = 255.0

    def _of(self, name: str, at: int) -> OutputDifference:
        if name not in self._found:
            self._found[name] = OutputDifference(first_s=at / SECOND)
        return self._found[name]

    def _draw(self, leaf: str, at: int, was: object, now: object) -> None:
        curves = self.curves.setdefault(leaf, Curves([], []))
        for value, points in ((was, curves.recorded), (now, curves.replayed)):
            if _is_number(value) and math.isfinite(value):  # type: ignore[arg-type]
                points.append((at / SECOND, float(value)))  # type: ignore[arg-type]


def leaves(name: str, form: object) -> Iterator[tuple[str, object]]:
    """The fields of a value, with their names; a value without fields is one itself."""
    if isinstance(form, dict) and len(form) == 1:
        ((word, parts),) = form.items()
        if word in ("array", "scalar") and (numbers := numbers_in(form)) is not form:
            yield from leaves(name, numbers)
            return
        if (word in ("list", "dict") or ":" in str(word)) and isinstance(parts, list):
            form = parts
    if isinstance(form, dict):
        for key, value in form.items():
            yield from leaves(f"{name}.{key}", value)
    elif isinstance(form, list | tuple):
        for place, value in enumerate(form):
            yield from leaves(f"{name}[{place}]", value)
    elif isinstance(form, bytes):
        yield from leaves(name, list(form))
    else:
        yield name, form


def _written(messages: Any) -> bytes:  # noqa: ANN401 -- of a bus or of a port
    """The bytes of a transfer that go out."""
    if isinstance(messages, bytes):
        return messages
    return b"".join(bytes(each) for each in messages if not isinstance(each, int))


def _is_number(value: object) -> bool:
    """Return whether it is one that a float can hold: a whole number may be beyond any."""
    return isinstance(value, float) or (isinstance(value, int) and value.bit_length() < 1024)
