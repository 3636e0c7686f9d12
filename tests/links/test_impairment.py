"""A bad network is what its option says, and the same for the same seed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.cut.impaired_path import Decisions, Impairment, impairment

BAD = Impairment(
    delay=80 * MILLISECOND,
    jitter=10 * MILLISECOND,
    loss=0.02,
    reorder=0.01,
    duplicate=0.005,
    seed=7,
)


def test_the_option_says_every_part_of_it() -> None:
    text = "delay=80ms,jitter=10ms,loss=2%,reorder=1%,duplicate=0.5%,seed=7"
    assert impairment(text) == BAD
    assert str(BAD) == text


@given(
    st.builds(
        Impairment,
        delay=st.integers(100, 1000).map(lambda ms: ms * MILLISECOND),
        jitter=st.integers(0, 100).map(lambda ms: ms * MILLISECOND),
        loss=st.integers(0, 100).map(lambda percent: percent / 100),
        seed=st.integers(0, (1 << 53) - 1),
    )
)
def test_what_is_written_is_read_again(how: Impairment) -> None:
    assert impairment(str(how)) == how


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("", 1),
        ("delay=80", 1),
        ("delay=-1ms,loss=2", 2),
        ("delay=nanms", 1),
        ("loss=101%", 1),
        ("jitter=2ms,delay=1ms", 1),
        ("delya=80ms", 1),
        ("seed=-1,loss=1%,loss=2%", 2),
        ("delay=11s,loss=x%,what", 3),
    ],
)
def test_all_faults_are_listed_at_once(text: str, faults: int) -> None:
    with pytest.raises(ConfigError) as refused:
        impairment(text)
    assert len(refused.value.faults) == faults


def test_the_same_seed_makes_the_same_decisions() -> None:
    one, again = Decisions(BAD, "out"), Decisions(BAD, "out")
    made = [one.next() for _ in range(2000)]
    assert made == [again.next() for _ in range(2000)]
    back = Decisions(BAD, "back")
    assert made != [back.next() for _ in range(2000)]


def test_what_happens_to_one_datagram_does_not_depend_on_the_shares_of_others() -> None:
    worse = Decisions(Impairment(delay=BAD.delay, jitter=BAD.jitter, loss=0.5, seed=7), "out")
    better = Decisions(Impairment(delay=BAD.delay, jitter=BAD.jitter, seed=7), "out")
    pairs = [(worse.next(), better.next()) for _ in range(500)]
    assert all(lossy in ((), sound) for lossy, sound in pairs)


def test_shares_and_delays_are_about_what_was_asked() -> None:
    decisions = Decisions(BAD, "out")
    made = [decisions.next() for _ in range(20_000)]
    delays = [delay for copies in made for delay in copies]
    assert 0.015 < sum(copies == () for copies in made) / len(made) < 0.025
    assert 0.003 < sum(len(copies) == 2 for copies in made) / len(made) < 0.008
    assert 0.005 < sum(delay == 0 for delay in delays) / len(delays) < 0.015
    late = [delay for delay in delays if delay > 0]
    assert min(late) >= BAD.delay - BAD.jitter
    assert max(late) <= BAD.delay + BAD.jitter
