"""A float that is the next one in any place of what left the models is found, and named."""

from collections.abc import Iterator
from math import inf, nextafter
from pathlib import Path
from random import Random
from typing import Any

import msgspec
import pytest

from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.blackbox.section import Kind, decode, encode, sent_of
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.replay.verdict import replay
from tests.support.recorded import every_section, record, rewrite

PLACES = 25
TRACKING = ("controller.mode=track", "trajectory.kind=circle")


@pytest.mark.slow
@pytest.mark.parametrize("settings", [(), TRACKING], ids=["platform", "circle"])
def test_every_float_that_is_one_unit_off_is_found_and_named(
    tmp_path: Path, settings: tuple[str, ...]
) -> None:
    path = record(tmp_path / "run.recording", "tachobot", 2, ("recording.minutes=10", *settings))
    recording = read_recording(path)
    board, contents = board_of(recording.header), every_section(path)
    own = [
        number
        for number, port in enumerate(recording.header.ports)
        if port.rpartition(".")[0] not in recording.header.world  # which is played back
    ]
    random = Random(20261126)  # noqa: S311 -- no secret
    for place, pair, leaf in random.sample(list(_floats(contents, own)), PLACES):
        section = decode(contents[place])
        sent = [list(each) for each in sent_of(section)]
        sent[pair][1] = _changed(sent[pair][1], leaf)
        section.sent = msgspec.Raw(encode([each for one in sent for each in one]))
        changed = [*contents[:place], encode(section), *contents[place + 1 :]]
        rewrite(path, changed)
        verdict = replay(read_recording(path), board)
        assert verdict.first is not None
        port = recording.header.ports[sent[pair][0]]
        assert (verdict.first.what, verdict.first.where, verdict.first.at) == (
            *("value", port),
            section.at,
        )
        assert verdict.differences == 1
        assert not verdict.is_identical


def _floats(contents: list[bytes], own: list[int]) -> Iterator[tuple[int, int, list[int]]]:
    """Section, place among what was sent in it, and where in the value a float is."""
    for place, content in enumerate(contents):
        section = decode(content)
        if section.kind is Kind.STEP:
            for pair, (number, form) in enumerate(sent_of(section)):
                if number in own:
                    yield from ((place, pair, leaf) for leaf in _leaves(form))


def _leaves(form: Any) -> Iterator[list[int]]:  # noqa: ANN401 -- any recorded form
    if isinstance(form, float):
        yield []
    if isinstance(form, list):
        for number, each in enumerate(form):
            yield from ([number, *leaf] for leaf in _leaves(each))


def _changed(form: Any, leaf: list[int]) -> Any:  # noqa: ANN401 -- as above
    if not leaf:
        return nextafter(form, inf)
    first, *rest = leaf
    return [_changed(each, rest) if n == first else each for n, each in enumerate(form)]
