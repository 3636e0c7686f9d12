"""Whose values leave a port: of a coupled model those of the atomics behind it."""

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.senders import Senders


class Source(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.out = self.out_port("out", int)


class Box(Coupled):
    """One source, or several, behind one port; the input passes through to a port of its own."""

    def __init__(self, name: str, *inner: Source | Coupled) -> None:
        super().__init__(name)
        self.out = self.out_port("out", int)
        self.unused = self.out_port("unused", int)
        self.given = self.in_port("given", int)
        self.passed = self.out_port("passed", int)
        self.couple(self.given, self.passed)
        for each in inner:
            self.add(each)
            self.couple(each.out_ports["out"], self.out)


@pytest.fixture
def senders() -> Senders:
    root = Coupled("root")
    root.add(Box("outer", Box("inner", Source("deep"))))
    root.add(Box("pair", Source("left"), Source("right")))
    return Senders(root)


def test_a_port_s_values_go_by_the_atomic_that_sends_them(senders: Senders) -> None:
    assert senders.of("outer.inner.deep.out") == ("outer.inner.deep.out",)
    assert senders.of("outer.inner.out") == senders.of("outer.out") == ("outer.inner.deep.out",)
    assert senders.of("pair.out") == ("pair.left.out", "pair.right.out")


@pytest.mark.parametrize("path", ["outer.unused", "outer.passed", "world.place", "", "root.x"])
def test_a_port_that_nothing_in_the_model_sends_through_goes_by_its_own_name(
    senders: Senders, path: str
) -> None:
    assert senders.of(path) == (path,)


def test_a_port_carries_what_is_sent_through_it_by_any_of_its_names(senders: Senders) -> None:
    assert senders.carry("outer.out", "outer.inner.deep.out")
    assert senders.carry("outer.inner.deep.out", "outer.out")
    assert senders.carry("pair.out", "pair.left.out")
    assert not senders.carry("pair.left.out", "pair.out")
    assert not senders.carry("outer.out", "pair.left.out")
