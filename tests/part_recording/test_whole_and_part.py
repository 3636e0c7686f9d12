"""A part of a random model, cut off at random, replays what it did in the whole."""

from typing import TypeAlias

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.part import part_of
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.part_recording.comparison import Comparison, compare
from firmware_runtime.part_recording.cut import cut_around
from firmware_runtime.part_recording.recorder import Recorder
from firmware_runtime.part_recording.replay import replay
from tests.support.random_models import Node, blueprints, build
from tests.support.recorded_models import KeptFrames, header_of, recording_of

END = 60


Arrivals: TypeAlias = list[tuple[int, int, int]]
"""Values for the model's own inputs: instant, side, value; some instants come twice."""

arrivals_of_a_run = st.lists(
    st.tuples(st.integers(0, 12), st.integers(0, 1), st.integers(0, 99)), max_size=12
).map(sorted)


def run_whole(root: Coupled, names: list[str], arrivals: Arrivals) -> KeptFrames:
    simulator = Simulator(root)
    sink = KeptFrames()
    cut = cut_around(root, names)
    recorder = Recorder(simulator, cut, header_of(cut), sink, is_real_time=False)
    for at, side, value in [*arrivals, (END, 0, 0)]:
        while simulator.next_at <= at:
            simulator.advance(simulator.next_at)
            recorder.between_steps(0, 0)
        if at < END:
            simulator.inject(root.in_ports[f"in_{side}"], value)
            simulator.advance(at)  # a visit of its own, also where the instant was taken before
            recorder.between_steps(0, 0)
    recorder.close("ended", "")
    return sink


def replayed(node: Node, names: list[str], sink: KeptFrames) -> Comparison:
    whole = build(node)
    assert isinstance(whole, Coupled)
    recording = recording_of(sink)
    result = replay(recording, part_of(whole, names).model, lambda _: None)
    return compare(recording, result)


@pytest.mark.slow
@given(blueprints(), st.data(), arrivals_of_a_run)
def test_whole_and_replay_are_equal(node: Node, data: st.DataObject, arrivals: Arrivals) -> None:
    root = build(node)
    assert isinstance(root, Coupled)
    names = data.draw(st.lists(st.sampled_from(list(root.components)), min_size=1, unique=True))
    sink = run_whole(root, names, arrivals)
    comparison = replayed(node, names, sink)
    assert comparison.first is None
    assert comparison.state is None
    if comparison.events:
        assert comparison.is_equal


@pytest.mark.slow
@given(blueprints(), st.data(), arrivals_of_a_run)
def test_a_part_that_ran_alone_and_its_replay_are_equal(
    node: Node, data: st.DataObject, arrivals: Arrivals
) -> None:
    """As the controller of two processes: what crosses the cut arrives from outside."""
    root = build(node)
    assert isinstance(root, Coupled)
    names = data.draw(st.lists(st.sampled_from(list(root.components)), min_size=1, unique=True))
    part = part_of(root, names)
    entries = list(part.model.in_ports.values())
    simulator, sink = Simulator(part.model), KeptFrames()
    cut = cut_around(part.model, names)
    recorder = Recorder(simulator, cut, header_of(cut), sink, is_real_time=False)
    for at, side, value in [*arrivals, (END, 0, 0)]:
        while simulator.next_at <= at:
            simulator.advance(simulator.next_at)
            recorder.between_steps(0, 0)
        if at < END and entries:
            simulator.inject(entries[(value + side) % len(entries)], value)
            simulator.advance(at)
            recorder.between_steps(0, 0)
    recorder.close("ended", "")
    comparison = replayed(node, names, sink)
    assert (comparison.first, comparison.state) == (None, None)
