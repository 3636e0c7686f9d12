"""What tuning found, for people and as a document."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from firmware_runtime.board.registry import Board
from firmware_runtime.statistics.run_text import aligned
from firmware_runtime.system.packages import module_of_extra

if TYPE_CHECKING:
    from firmware_runtime.lab.tuning.loop import Gains, Margins
    from firmware_runtime.lab.tuning.search import Tuned
    from firmware_runtime.lab.tuning.task import Task


def tuned_document(
    board: Board, keys: dict[str, str], task: "Task", tuned: "Tuned"
) -> dict[str, object]:
    """Return gains, margins and costs, shipped and tuned, for JSON."""
    plant = module_of_extra("firmware_runtime.lab.identification.plant", "tuning")
    structure = "rotation" if board.plant is None else board.plant.structure
    shipped, found = tuned.seen
    return {
        "board": board.name,
        "plant": dict(zip(plant.KEYS[structure], task.body.plant.values, strict=True)),
        "gains": {key: getattr(tuned.gains, name) for name, key in keys.items()},
        "shipped": {key: getattr(task.shipped, name) for name, key in keys.items()},
        "margins": _margins_json(tuned.margins),
        "shipped_margins": _margins_json(tuned.shipped_margins),
        "cost": {"shipped": shipped, "tuned": found},
        "unseen": {
            "runs": len(tuned.unseen),
            "better": tuned.better,
            "cost": {"shipped": _mean(tuned, 0), "tuned": _mean(tuned, 1)},
        },
    }


def _margins_json(found: "Margins") -> dict[str, float | None]:
    values = {"gain_db": found.gain_db, "phase_deg": found.phase_deg, "delay_s": found.delay_s}
    return {key: value if abs(value) < float("inf") else None for key, value in values.items()}


def _mean(tuned: "Tuned", place: int) -> float:
    return sum(each[place] for each in tuned.unseen) / len(tuned.unseen)


def tuned_lines(keys: dict[str, str], task: "Task", tuned: "Tuned") -> Iterator[str]:
    """Both sets of gains beside each other, and how they fare."""
    rows: list[tuple[str, ...]] = [("", "shipped", "tuned")]
    rows += [(key, *_both(task.shipped, tuned.gains, name)) for name, key in keys.items()]
    before, after = tuned.shipped_margins, tuned.margins
    rows.append(("gain margin, dB", f"{before.gain_db:.1f}", f"{after.gain_db:.1f}"))
    rows.append(("phase margin, deg", f"{before.phase_deg:.0f}", f"{after.phase_deg:.0f}"))
    rows.append(("cost, s2", *(f"{each:.3g}" for each in tuned.seen)))
    rows.append(("cost of unseen runs, s2", f"{_mean(tuned, 0):.3g}", f"{_mean(tuned, 1):.3g}"))
    yield from aligned(rows)
    yield f"better in {tuned.better} of {len(tuned.unseen)} runs that were not searched on"


def _both(shipped: "Gains", tuned: "Gains", name: str) -> tuple[str, str]:
    return f"{getattr(shipped, name):.4g}", f"{getattr(tuned, name):.4g}"
