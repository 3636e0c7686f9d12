from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.position_fix import FixReport, PositionState
from firmware_runtime.models.position_watch import PositionPatience, PositionWatch
from tests.support.atomic_bench import AtomicBench

PATIENCE = PositionPatience(coasts=SECOND // 4, lost=SECOND, safe=5 * SECOND)
FIX = FixReport(True, "", 0.0, 0.0, 0.0, 0.0)
TRACKING, COASTING, LOST, SAFE = (
    PositionState.TRACKING,
    PositionState.COASTING,
    PositionState.LOST,
    PositionState.SAFE,
)


def states(fixes_s: list[float], until_s: float) -> list[tuple[float, PositionState]]:
    """What the watch says, and when, if positions come at these times."""
    bench = AtomicBench(PositionWatch("watch", PATIENCE))
    for at_s in fixes_s:
        bench.put(at_s * 1000, fix=FIX)
    bench.run(until_s * 1000)
    return [(at_ms / 1000, state) for at_ms, state in bench.said["state"]]


def test_it_says_nothing_before_the_first_position() -> None:
    assert states([], 100.0) == []


def test_positions_that_keep_coming_are_tracking_said_once() -> None:
    assert states([0.1 * n for n in range(1, 30)], 3.0) == [(0.1, TRACKING)]


def test_each_stage_is_counted_from_the_last_position() -> None:
    said = states([1.0, 1.2], 100.0)
    assert said == [(1.0, TRACKING), (1.45, COASTING), (2.2, LOST), (6.2, SAFE)]


def test_a_position_returns_it_to_tracking_from_coasting_and_from_lost() -> None:
    said = states([1.0, 1.5, 4.0], 4.1)
    assert said == [(1.0, TRACKING), (1.25, COASTING), (1.5, TRACKING), (1.75, COASTING),
                    (2.5, LOST), (4.0, TRACKING)]  # fmt: skip


def test_nothing_returns_from_safe() -> None:
    assert states([1.0, 7.0, 7.1], 8.0)[-1] == (6.0, SAFE)


def test_it_reports_that_no_position_was_believed_once_for_each_stage() -> None:
    bench = AtomicBench(PositionWatch("watch", PATIENCE))
    bench.put(1000, fix=FIX)
    bench.run(7000)
    none = "watch: no position was believed for {} s; expected one that agrees"
    assert [(fault.kind, fault.reason, fault.consecutive) for _, fault in bench.said["fault"]] == [
        ("NotReady", none.format(span), 1) for span in ("0.25", "1")
    ]
