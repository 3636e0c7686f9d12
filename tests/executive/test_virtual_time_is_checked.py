"""The commonest mistakes of all are found in virtual time without being asked for."""

import pytest

from firmware_runtime import Atomic, Coupled, ModelError, Simulator, run


class Sender(Atomic):
    """Sends a value of another type, or sends in a transition."""

    def __init__(self, name: str, value: object, *, in_transition: bool) -> None:
        super().__init__(name)
        self.out = self.out_port("out", float)
        self.value, self.in_transition = value, in_transition

    def initialize(self) -> None:
        self.hold_in("waiting", 1000)

    def output(self) -> None:
        if not self.in_transition:
            self.out.send(self.value)  # type: ignore[arg-type]

    def internal(self) -> None:
        if self.in_transition:
            self.out.send(1.0)
        self.passivate()


class Taker(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.entrance = self.in_port("in", float)


def mistaken(value: object, *, in_transition: bool = False) -> Coupled:
    top = Coupled("top")
    sender = top.add(Sender("sender", value, in_transition=in_transition))
    top.couple(sender.out, top.add(Taker("taker")).entrance)
    return top


@pytest.mark.parametrize(
    ("value", "in_transition", "what"),
    [
        ("one", False, "top.sender.*port 'out' carries float, not 'one'"),
        (1.0, True, "top.sender.*sent on port 'out' outside its output function"),
    ],
)
def test_a_simulator_and_a_run_in_virtual_time_name_the_mistake(
    value: object, *, in_transition: bool, what: str
) -> None:
    with pytest.raises(ModelError, match=what):
        Simulator(mistaken(value, in_transition=in_transition)).run(2000)
    with pytest.raises(ModelError, match=what):
        run(mistaken(value, in_transition=in_transition), for_s=1e-5, clock="virtual")
