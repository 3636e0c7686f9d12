"""Faults in the journal: at once when new, summed up when they go on."""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.fault_log import CountedFault, FaultLog
from firmware_runtime.runs.reporter import AGAIN_AFTER, FaultJournal
from firmware_runtime.system.messages import Journal


class Written(Journal):
    """Keeps what is written: messages, and the number of faults by then."""

    def __init__(self) -> None:
        super().__init__(None)
        self.entries: list[tuple[str, object]] = []

    def write(self, message: str, priority: int = 5, **fields: object) -> None:
        del priority
        self.entries.append((message, fields["COUNT"]))


class Rig:
    def __init__(self) -> None:
        self.faults = FaultLog(Simulator(Atomic("robot")))
        self.journal = Written()
        self.fault_journal = FaultJournal(self.faults, self.journal)

    def report(self, kind: str, times: int = 1) -> None:
        known = [each for each in self.faults.counted if each.kind == kind]
        counted = known[0] if known else CountedFault(kind, path="imu")
        if not known:
            self.faults.counted.append(counted)
        counted.count += times
        counted.sentence = f"sentence {counted.count}"


def test_a_new_kind_is_written_at_once() -> None:
    rig = Rig()
    rig.report("NotReady")
    rig.fault_journal.write_due(0)
    rig.report("BusFault")
    rig.fault_journal.write_due(1)
    assert rig.journal.entries == [
        ("imu: NotReady: sentence 1", 1),
        ("imu: BusFault: sentence 1", 1),
    ]


def test_one_that_goes_on_is_written_seldom_with_its_number() -> None:
    rig = Rig()
    for second in range(21):
        rig.report("NotReady", times=100)
        rig.fault_journal.write_due(second * SECOND)
    assert [count for _, count in rig.journal.entries] == [100, 1100, 2100]
    assert AGAIN_AFTER == 10 * SECOND
    assert "1000 times" in rig.journal.entries[1][0]


def test_one_that_is_over_is_written_no_more() -> None:
    rig = Rig()
    rig.report("NotReady")
    for second in range(100):
        rig.fault_journal.write_due(second * SECOND)
    assert len(rig.journal.entries) == 1


def test_the_end_writes_what_was_held_back() -> None:
    rig = Rig()
    rig.report("NotReady")
    rig.fault_journal.write_due(0)
    rig.report("NotReady", times=3)
    rig.fault_journal.write_due(SECOND)
    rig.fault_journal.close()
    assert [count for _, count in rig.journal.entries] == [1, 4]
