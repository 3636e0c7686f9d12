"""Two ends of a link over a bad network, by a seed: what enters is what the rules of delivery say.

The network delays, reorders, loses and duplicates datagrams. What left is held against what
entered, step by step, on one clock that the test moves.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush
from itertools import count
from typing import TypeAlias

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.inbox import Bag
from firmware_runtime.links.cut.cut import Terms
from firmware_runtime.links.cut.impaired_path import Decisions, Impairment
from firmware_runtime.links.cut.refusal import Reason
from firmware_runtime.links.cut.wire import Kind
from tests.support.link_rig import Way, link_of, role_of

PORTS = {"mind.order": str, "mind.sample": int, "mind.state": int, "body.turned": int}
TERMS = Terms(
    timeout=2 * SECOND, ordered=frozenset({"mind.order"}), retain=frozenset({"mind.state"})
)
TICK = 5 * MILLISECOND
Event: TypeAlias = list[tuple[str, object]]


def is_nothing(_datagram: bytes, _now: int) -> bool:
    """Nothing is lost."""
    return False


def is_step(datagram: bytes, _now: int) -> bool:
    """Steps are lost, and everything else passes."""
    return datagram[4] == Kind.STEP


@dataclass
class Network:
    """One way: datagrams arrive when `Decisions` says."""

    decisions: Decisions
    waiting: list[tuple[int, int, bytes]] = field(default_factory=list)
    sent: int = 0
    loses: Callable[[bytes, int], bool] = is_nothing
    """Whether a datagram that is sent at an instant is lost in any case."""

    def send(self, datagram: bytes, now: int) -> None:
        if self.loses(datagram, now):
            return
        self.sent += 1
        for delay in self.decisions.next():
            heappush(self.waiting, (now + delay, self.sent, datagram))

    def arrived(self, now: int) -> Sequence[bytes]:
        found = []
        while self.waiting and self.waiting[0][0] <= now:
            found.append(heappop(self.waiting)[2])
        return found


class End:
    """One end, whose clock is `ahead` of the test's."""

    def __init__(self, role: str, out: Network, ahead: int, terms: Terms) -> None:
        self.now = 0
        self.ahead = ahead
        self.bad: list[str] = []
        self._way = Way(lambda frame: out.send(frame, self.now))
        self.link = link_of(
            role_of(PORTS, role),
            self._way,
            terms,
            lambda: self.now + self.ahead,
            takes_old=role == "body",
        )
        self.link.on_bad = self.bad.append
        self.listeners = {each.name: self.link.leaves(each) for each in self.link.cut.leaving}

    def pass_(self, now: int, arrived: Sequence[bytes]) -> list[Event]:
        """One pass of its loop; the events that came."""
        self.now = now
        self._way.waits.extend(arrived)
        events: Sequence[Bag] = self.link.events()
        self.link.between_steps(now, 0)
        return [[(port.name.replace(":", "."), value) for port, value in bag] for bag in events]


class Pair:
    """Both ends, and what left and what entered so far."""

    def __init__(self, how: Impairment, terms: Terms = TERMS) -> None:
        self.now = SECOND
        self.ways = (Network(Decisions(how, "out")), Network(Decisions(how, "back")))
        self.mind = End("mind", self.ways[0], 0, terms)
        self.body = End("body", self.ways[1], 12_345 * SECOND, terms)
        self.left: list[Event] = []
        self.entered: list[Event] = []
        self.numbers = count(1)
        while not (self.is_good_to(self.mind) and self.is_good_to(self.body)):
            self.tick()
            assert self.now < 60 * SECOND, "they meet"

    def is_good_to(self, end: End) -> bool:
        return end.link.peer.is_good(self.now + end.ahead)

    def tick(self, *leaves: str) -> None:
        """Let time pass; by each of these ports a value leaves, all in one step."""
        self.now += TICK
        if leaves:
            number = next(self.numbers)
            step: Event = []
            for name in leaves:
                value = f"order {number}" if name == "mind.order" else number
                self.mind.listeners[name](self.now, value)
                step.append((name, value))
            self.left.append(step)
        self.mind.pass_(self.now, self.ways[1].arrived(self.now))
        self.entered += self.body.pass_(self.now, self.ways[0].arrived(self.now))

    def settle(self) -> None:
        for _ in range(400):
            self.tick()

    def of(self, name: str, events: list[Event]) -> list[object]:
        return [value for event in events for port, value in event if port == name]


def run(seed: int, loss: float, jitter: int, terms: Terms = TERMS) -> Pair:
    """Two seconds of samples, every tick, with an order now and then; and a while to settle."""
    how = Impairment(
        delay=40 * MILLISECOND, jitter=jitter, loss=loss, reorder=0.02, duplicate=0.05, seed=seed
    )
    pair = Pair(how, terms)
    for tick in range(400):
        leaves = ["mind.sample"]
        if (tick * 7 + seed) % 11 == 0:
            leaves.insert(0, "mind.order")
        if tick % 60 == seed % 60:
            leaves.append("mind.state")
        pair.tick(*leaves)
    pair.settle()
    return pair


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(("loss", "jitter"), [(0.02, 10), (0.2, 0), (0.1, 40)])
def test_events_all_enter_in_order_samples_rise_and_steps_stay_what_they_are(
    seed: int, loss: float, jitter: int
) -> None:
    pair = run(seed, loss, jitter * MILLISECOND)
    assert pair.body.bad == []
    assert pair.of("mind.order", pair.entered) == pair.of("mind.order", pair.left)
    for name in ("mind.sample", "mind.state"):
        numbers = [int(str(value)) for value in pair.of(name, pair.entered)]
        assert numbers == sorted(set(numbers)), "each once, and none after a newer one"
        assert numbers[-1:] == pair.of(name, pair.left)[-1:], "the last one arrives"
    steps = {str(step[0][1]).removeprefix("order "): step for step in pair.left}
    for event in pair.entered:
        numbers_in = {str(value).removeprefix("order ") for _, value in event}
        assert len(numbers_in) == 1, "what left in two steps never enters together"
        assert set(event) <= set(steps[numbers_in.pop()])
    counts = pair.body.link.counts
    entered = sum(map(len, pair.entered))
    assert counts.received == entered
    assert sum(counts.own.values()) == counts.own[Reason.REPLAYED], "duplicates, and nothing else"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_lost_or_repeated_where_the_network_only_shuffles(seed: int) -> None:
    everything = Terms(timeout=2 * SECOND, ordered=frozenset(PORTS) - {"body.turned"})
    pair = run(seed, 0.0, 30 * MILLISECOND, everything)
    assert [sorted(event) for event in pair.entered] == [sorted(step) for step in pair.left]
    assert (pair.body.bad, pair.mind.link.counts.given_up) == ([], 0)


@pytest.mark.parametrize("ordered", [frozenset(), frozenset({"mind.sample"})])
def test_a_last_command_that_is_lost_until_it_is_too_old_turns_outputs_off(
    ordered: frozenset[str],
) -> None:
    pair = Pair(Impairment(delay=MILLISECOND, seed=1), Terms(ordered=ordered))
    pair.tick("mind.sample")
    pair.settle()
    begin = pair.now
    pair.ways[0].loses = lambda datagram, now: is_step(datagram, now) and now - begin <= SECOND
    pair.tick("mind.sample")
    pair.settle()
    assert any("mind.sample was" in why for why in pair.body.bad)
    assert pair.body.link.counts.own[Reason.TOO_OLD] == 1


@pytest.mark.slow
def test_an_order_that_no_repetition_brings_is_a_failsafe_and_later_ones_enter() -> None:
    terms = Terms(ordered=frozenset({"mind.order"}))
    pair = Pair(Impairment(delay=MILLISECOND, seed=1), terms)
    pair.tick("mind.order")
    pair.settle()
    lost: list[bytes] = []

    def loses(datagram: bytes, _now: int) -> bool:
        if b"order 2" in datagram:
            lost.append(datagram)
            return True
        return False

    pair.ways[0].loses = loses
    for _ in range(3):
        pair.tick("mind.order")
    for _ in range(400):
        pair.tick("mind.sample")
    assert len(lost) > 2, "it was sent again"
    assert len(pair.body.bad) > 0
    assert pair.mind.link.counts.given_up > 0
    pair.tick("mind.order")
    pair.settle()
    assert pair.of("mind.order", pair.entered)[-1] == pair.of("mind.order", pair.left)[-1]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_an_end_that_is_started_again_takes_orders_from_then_on(seed: int) -> None:
    how = Impairment(delay=20 * MILLISECOND, jitter=20 * MILLISECOND, loss=0.05, seed=seed)
    pair = Pair(how)
    for _ in range(50):
        pair.tick("mind.order", "mind.state")
    pair.body = End("body", pair.ways[1], 99 * SECOND, TERMS)
    pair.entered.clear()
    while not (pair.is_good_to(pair.mind) and pair.is_good_to(pair.body)):
        pair.tick("mind.sample")
        assert pair.now < 60 * SECOND, "they meet again"
    pair.settle()
    assert pair.of("mind.state", pair.entered) == [50], "what is retained, once"
    begins = len(pair.left)
    for _ in range(50):
        pair.tick("mind.order")
    pair.settle()
    orders = pair.of("mind.order", pair.entered)
    assert orders[-50:] == pair.of("mind.order", pair.left[begins:])
    before = pair.of("mind.order", pair.left[:begins])
    assert orders[:-50] == before[len(before) - len(orders[:-50]) :], (
        "the last that had not arrived"
    )
    assert pair.body.bad == []


@pytest.mark.slow
def test_a_session_of_two_days_with_clocks_that_drift_stays_as_it_was() -> None:
    pair = Pair(Impairment(delay=5 * MILLISECOND, jitter=5 * MILLISECOND, seed=3))
    hour, drift = 3600 * SECOND, 50 * 3600 * 1000  # 50 ppm of an hour, ns
    for peer in (pair.mind.link.peer, pair.body.link.peer):
        peer._counter = 48 * hour // TICK
    for _ in range(48):
        for _ in range(20):
            pair.tick("mind.order", "mind.sample")
        for _ in range(900):  # an estimate is forgotten within eight seconds
            pair.body.ahead += drift // 900
            pair.tick()
    pair.settle()
    assert (pair.body.bad, pair.mind.bad) == ([], [])
    assert pair.of("mind.order", pair.entered) == pair.of("mind.order", pair.left)
    here, there = (pair.now + end.ahead for end in (pair.body, pair.mind))
    age = pair.body.link.peer.clock.age(here, there)
    assert age is not None
    assert age < SECOND


@pytest.mark.slow
def test_a_sender_whose_clock_goes_back_drives_nothing() -> None:
    pair = Pair(Impairment(delay=5 * MILLISECOND, seed=1))
    pair.mind.ahead = 30 * SECOND
    for _ in range(100):
        pair.tick("mind.sample")
    pair.mind.ahead -= 5 * SECOND
    for _ in range(10):  # what is under way
        pair.tick()
    pair.entered.clear()
    for _ in range(4 * SECOND // TICK):
        pair.tick("mind.sample", "mind.order")
    assert len(pair.body.bad) > 0
    assert pair.entered == []
    assert pair.body.link.counts.own[Reason.WENT_BACK] > 0


def test_an_end_whose_steps_do_not_arrive_may_not_drive_until_they_do() -> None:
    pair = Pair(
        Impairment(delay=40 * MILLISECOND, jitter=10 * MILLISECOND, loss=0.02, seed=1), Terms()
    )
    for _ in range(200):
        pair.tick("mind.sample")
    assert (pair.mind.bad, pair.mind.link.why_not(0)) == ([], None)
    begin = pair.now
    pair.ways[0].loses = is_step
    while not pair.mind.bad:
        pair.tick("mind.sample")
        assert pair.now - begin < SECOND, "it turns bad"
    assert pair.now - begin >= Terms().timeout
    assert pair.is_good_to(pair.mind), "the other end is there, and says so"
    for _ in range(400):
        pair.tick("mind.sample")
        assert "does not arrive" in str(pair.mind.link.why_not(0))
    pair.ways[0].loses = is_nothing
    arrives = pair.now
    while pair.mind.link.why_not(0) is not None:
        pair.tick("mind.sample")
        assert pair.now - arrives < 2 * SECOND, "it is good again"
    assert pair.now - arrives > Terms().good
    assert len(pair.mind.bad) == 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_a_bad_network_alone_keeps_no_end_from_driving(seed: int) -> None:
    how = Impairment(
        delay=80 * MILLISECOND, jitter=40 * MILLISECOND, loss=0.1, reorder=0.05, seed=seed
    )
    pair = Pair(how, Terms())
    for tick in range(2000):
        pair.tick(*["mind.sample"] * (tick % 7 == 0 or tick < 1000))
    assert pair.mind.bad == []


@pytest.mark.parametrize("every", [30, 200], ids=["a stream", "a command now and then"])
def test_a_robot_that_gets_heartbeats_and_no_steps_goes_off_until_it_gets_them(every: int) -> None:
    pair = Pair(Impairment(delay=20 * MILLISECOND, seed=1), Terms())
    pair.tick("mind.sample")
    pair.settle()
    pair.ways[0].loses = is_step
    begin = pair.now + TICK
    for tick in range(400):
        pair.tick(*["mind.sample"] * (tick % every == 0))
        is_early = pair.now - begin < Terms().timeout
        assert (pair.body.bad == []) is is_early
        assert pair.is_good_to(pair.body), "its controller is there, and says so"
    assert pair.body.bad == ["mind.sample has left and does not arrive"]
    assert "does not arrive" in str(pair.body.link.why_not(0))
    pair.ways[0].loses = is_nothing
    for _ in range(300):
        pair.tick("mind.sample")
    assert pair.body.link.why_not(0) is None


def test_a_rare_command_that_is_lost_is_noticed_beside_a_stream_that_arrives() -> None:
    pair = Pair(Impairment(delay=20 * MILLISECOND, seed=1), Terms(ordered=frozenset()))
    for _ in range(100):
        pair.tick("mind.sample")
    pair.ways[0].loses = lambda datagram, now: is_step(datagram, now) and b"order" in datagram
    pair.tick("mind.order")
    left_at = pair.now
    while not pair.body.bad:
        pair.tick("mind.sample")
        assert pair.now - left_at <= Terms().timeout + 50 * MILLISECOND
    assert pair.now - left_at >= Terms().timeout
    assert pair.body.bad == ["mind.order has left and does not arrive"]
    assert len(pair.of("mind.sample", pair.entered)) > 100, "which goes on"


def test_a_last_order_that_is_lost_keeps_outputs_off_until_it_is_there() -> None:
    pair = Pair(Impairment(delay=MILLISECOND, seed=1), Terms(ordered=frozenset({"mind.order"})))
    pair.tick("mind.order")
    pair.settle()
    pair.ways[0].loses = is_step
    pair.tick("mind.order")
    pair.settle()
    assert pair.body.bad == ["mind.order has left and does not arrive"]
    assert "does not arrive" in str(pair.body.link.why_not(0))
    pair.ways[0].loses = is_nothing
    pair.settle()
    assert pair.body.link.counts.own[Reason.TOO_OLD] == 1
    assert pair.body.link.why_not(0) is None


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_a_link_is_not_cut_while_everything_that_counts_arrives_in_time(seed: int) -> None:
    """Delays of up to 0.48 s for a timeout of 0.5: what has not been confirmed is not missing."""
    how = Impairment(
        delay=240 * MILLISECOND, jitter=230 * MILLISECOND, reorder=0.05, duplicate=0.02, seed=seed
    )
    pair = Pair(how, Terms(retain=frozenset({"mind.state"})))
    for tick in range(1500):
        pair.tick(*["mind.sample"] * (tick % 2), *["mind.order"] * (tick % 90 == 0))
    assert all("does not arrive" not in why for why in pair.body.bad)
