"""What a section's replay sent and counted, beside what the recording has of it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

from firmware_runtime.blackbox.section import Section, encode_sent, pairs_of, sent_of
from firmware_runtime.devs.tapped_ports import Sent
from firmware_runtime.recording.values import unpack
from firmware_runtime.replay.difference import NOTHING, Difference
from firmware_runtime.replay.order import is_same_but_for_order

Counts: TypeAlias = Mapping[str, Mapping[str, int]]
"""By model and what is counted."""


def differences_of_sent(section: Section, sent: Sent, ports: Sequence[str]) -> Iterator[Difference]:
    """Values that are not the recorded ones, in order; `ports` are paths by number."""
    content = encode_sent(sent)
    if content == bytes(section.sent):
        return
    recorded, replayed, values = sent_of(section), pairs_of(unpack(content)), pairs_of(sent)
    for place in range(max(len(recorded), len(replayed))):
        was = recorded[place] if place < len(recorded) else None
        now = replayed[place] if place < len(replayed) else None
        if was is None or now is None or not _is_same(was, now, values[place]):
            yield _difference(section.at, was, now, ports)


def differences_of_counts(at: int, recorded: Counts, replayed: Counts) -> Iterator[Difference]:
    """What became of activations, where that is not what is recorded."""
    for path, counts in recorded.items():
        found = replayed.get(path, {})
        for name, count in counts.items():
            if found.get(name) != count:
                yield Difference(at, "count", path, name, count, found.get(name, NOTHING))


def _is_same(was: Any, now: Any, sent: Any) -> bool:  # noqa: ANN401 -- pairs
    if encode_sent([*was]) == encode_sent([*now]):
        return True
    return bool(was[0] == now[0]) and is_same_but_for_order(sent[1], was[1])


def _difference(at: int, was: Any, now: Any, ports: Sequence[str]) -> Difference:  # noqa: ANN401
    if was is not None and now is not None and was[0] != now[0]:
        now = None  # it sent from another port: what was sent then is missing
    number = (was if was is not None else now)[0]
    path = ports[number] if 0 <= number < len(ports) else f"port {number}"
    model, _, port = path.rpartition(".")
    recorded = NOTHING if was is None else was[1]
    return Difference(at, "value", model, port, recorded, NOTHING if now is None else now[1])
