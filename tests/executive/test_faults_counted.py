"""Every fault that leaves a model is counted, whether or not its port is coupled."""

from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.statistics.fault_table import KINDS, OTHER_KINDS
from tests.support.executives import Run

PERIOD = 10 * MILLISECOND


class GraveFault(Fault):
    """A fault of another model's making."""


class Failing(Atomic):
    """Reports a fault every period, of the kind that its number is mapped to; some have none."""

    def __init__(self, name: str, *kinds: str | None, type_: type[Fault] = Fault) -> None:
        super().__init__(name)
        self.trouble = self.out_port("trouble", type_)
        self.values = self.out_port("values", float)
        self.kinds = list(kinds)
        self.type = type_

    def initialize(self) -> None:
        self.hold_in("failing", PERIOD)

    def output(self) -> None:
        self.values.send(1.0)
        if self.kinds and self.kinds[0] is not None:
            self.trouble.send(self.type(self.kinds[0], f"sentence {len(self.kinds)}", 1))

    def internal(self) -> None:
        del self.kinds[:1]
        self.hold_in("failing", PERIOD)


class Collecting(Atomic):
    """Takes faults in."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.faults = self.in_port("faults", Fault)
        self.taken: list[Fault] = []

    def external(self, elapsed: int) -> None:
        self.taken += self.faults
        self.continue_(elapsed)


def faults_of(*models: Atomic, periods: int = 50) -> dict[str, Any]:
    root = Coupled("robot")
    for model in models:
        root.add(model)
    run = Run(root, VirtualClock())
    run.until(periods * PERIOD)
    faults: dict[str, Any] = run.json()["faults"]
    return faults


def test_a_port_that_nothing_is_coupled_to_counts() -> None:
    assert faults_of(Failing("imu", "NotReady", None, "NotReady", "NotReady", None)) == {
        "imu": {"NotReady": {"count": 3, "first_s": 0.01, "last_s": 0.04, "last": "sentence 2"}}
    }


def test_a_port_that_is_coupled_counts_once_however_many_take_it() -> None:
    root = Coupled("robot")
    failing = root.add(Failing("imu", "NotReady"))
    takers = [root.add(Collecting(name)) for name in ("first", "second")]
    for taker in takers:
        root.couple(failing.trouble, taker.faults)
    run = Run(root, VirtualClock())
    run.until(5 * PERIOD)
    assert run.json()["faults"]["imu"]["NotReady"]["count"] == 1
    assert [len(taker.taken) for taker in takers] == [1, 1]


def test_a_port_of_a_narrower_type_counts_too() -> None:
    assert "imu" in faults_of(Failing("imu", "NotReady", type_=GraveFault))


def test_models_and_kinds_are_kept_apart_and_named_by_path() -> None:
    inner = Coupled("arm")
    inner.add(Failing("motor", "BusFault", "NotReady", "BusFault"))
    root = Coupled("robot")
    root.add(inner)
    root.add(Failing("imu", "NotReady"))
    root.add(Failing("calm"))
    run = Run(root, VirtualClock())
    run.until(10 * PERIOD)
    counts = {
        path: {kind: each["count"] for kind, each in kinds.items()}
        for path, kinds in run.json()["faults"].items()
    }
    assert counts == {"arm.motor": {"BusFault": 2, "NotReady": 1}, "imu": {"NotReady": 1}}


def test_a_flood_of_kinds_is_bounded_and_none_goes_uncounted() -> None:
    kinds = [f"Kind{number % (KINDS + 5)}" for number in range(40)]
    found = faults_of(Failing("imu", *kinds))["imu"]
    assert sum(each["count"] for each in found.values()) == 40
    assert len(found) == KINDS + 1
    assert found[OTHER_KINDS]["count"] == sum(int(kind[4:]) >= KINDS for kind in kinds)


def test_a_fault_in_the_step_that_fails_is_counted_too() -> None:
    class Breaking(Failing):
        def internal(self) -> None:
            raise OSError("gone")

    assert faults_of(Breaking("imu", "BusFault"))["imu"]["BusFault"]["count"] == 1


def test_a_run_without_faults_has_none() -> None:
    assert faults_of(Failing("imu"), Collecting("sink")) == {}


def test_kinds_alike_as_far_as_the_file_keeps_them_lose_no_fault() -> None:
    long = "MagnetometerOverflowedDuringConversion"
    kinds = [f"{long}{number % 12}" for number in range(40)]
    (counted,) = faults_of(Failing("compass", *kinds))["compass"].values()
    assert counted["count"] == 40
