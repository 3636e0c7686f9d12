"""Whose place a newcomer at the bridge takes."""

from collections import Counter
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.links.bridge.bridge import MOST, MOST_OF_ADDRESS, Sender, Senders
from firmware_runtime.links.ports.robot_end import RobotEnd


class Rig:
    """Senders, and those that lost their place."""

    def __init__(self) -> None:
        self.forgotten: list[Sender] = []
        self.all = Senders(self._forget)
        self.now = 0

    def add(self, host: str) -> Sender:
        """A newcomer at this address, at another port."""
        self.now += 1
        sender = Sender((host, self.now), RobotEnd(Path("/nowhere")), self.now)
        self.all.add(sender)
        return sender

    def _forget(self, sender: Sender) -> None:
        sender.end.close()
        self.forgotten.append(sender)


def test_one_more_port_of_an_address_takes_the_place_of_its_quietest() -> None:
    rig = Rig()
    other = rig.add("10.0.0.2")
    senders = [rig.add("10.0.0.1") for _ in range(MOST_OF_ADDRESS)]
    senders[0].spoke_at = rig.now + 1
    rig.add("10.0.0.1")
    assert rig.forgotten == [senders[1]]
    assert rig.all.find(other.address) is other
    rig.all.close()


def test_where_all_places_are_taken_the_address_with_most_gives_one() -> None:
    rig = Rig()
    quiet = rig.add("10.0.1.1")
    greedy = [rig.add("10.0.2.1") for _ in range(MOST_OF_ADDRESS)]
    for number in range(MOST - MOST_OF_ADDRESS - 1):
        rig.add(f"10.1.0.{number}")
    rig.add("10.0.3.1")
    assert rig.forgotten == [greedy[0]]
    assert rig.all.find(quiet.address) is quiet
    rig.all.close()


@given(st.lists(st.integers(0, 20), max_size=200))
def test_there_are_never_more_than_so_many(hosts: list[int]) -> None:
    rig = Rig()
    added = [rig.add(str(host)) for host in hosts]
    there = [each for each in added if rig.all.find(each.address) is each]
    assert len(there) == len(rig.all) <= MOST
    assert max(Counter(each.host for each in there).values(), default=0) <= MOST_OF_ADDRESS
    assert rig.all.displaced == len(rig.forgotten) == len(added) - len(there)
    if added:
        assert there[-1] is added[-1]
    rig.all.close()
