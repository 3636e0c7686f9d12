"""TachoBot's inertia and friction out of its square wave, beside what its world really has."""

from collections.abc import Iterator
from importlib import import_module
from typing import Any, Final

from firmware_boards.tachobot.experiments.square_wave import watched_s
from firmware_boards.tachobot.plant_settings import WorldSettings
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.trial import Trial
from firmware_runtime.system.packages import module_of_extra
from firmware_runtime.view.parts import Table, table

_TRUTH: Final = {
    "inertia_kg_m2": "yaw_inertia_kg_m2",
    "damping_nms": "yaw_damping_nms",
    "coulomb_friction_nm": "coulomb_friction_nm",
    "static_friction_nm": "static_friction_nm",
}
"""By the parameter's key: where the world has it."""


def run(trial: Trial) -> Findings:
    """Identify from one recording; the model that comes of it gets the very same input."""
    found = module_of_extra("firmware_runtime.lab.identification.identified", "tuning")
    source = import_module("firmware_runtime.lab.identification.source")
    words = import_module("firmware_runtime.lab.identification.identification_page")
    board, (stage, *_) = trial.board, trial.stages
    trial.say(f"{trial.experiment.title}: stage {stage}")
    with trial.run(stage, for_s=watched_s(board.settings)) as ran:
        said = f"{stage}: {ran.between}"
    series = source.read_series(trial.folder / f"{trial.name}-{stage}.recording", board)
    plant = source.plant_of(board)
    identified, fit = found.identify(series, plant.structure, plant.lag_s(board.settings))
    input_plot, output_plot, difference = words.plots(identified, series, fit)
    return Findings(
        ours={
            **{key: each.value for key, each in identified.parameters.items()},
            "explained_percent": 100.0 * identified.explained,
        },
        sentences=list(words.sentences(identified)),
        plots={"": output_plot, "input": input_plot, "difference": difference},
        data={"": _csv(series, fit)},
        tables=[_table(identified, board.settings.world)],
        details={"identified": found.as_json(identified)},
        between=[said],
    )


def _table(identified: Any, world: WorldSettings) -> Table:  # noqa: ANN401 -- needs scipy
    rows = []
    for key, each in identified.parameters.items():
        truth = getattr(world, _TRUTH[key]) if key in _TRUTH else None
        ends = ["unknown" if end is None else f"{end:.5g}" for end in (each.low, each.high)]
        rows.append((key, f"{each.value:.5g}", *ends, "" if truth is None else f"{truth:g}"))
    return table("Identified, and in the world", ("", "value", "95% from", "to", "world"), rows)


def _csv(series: Any, fit: Any) -> Iterator[str]:  # noqa: ANN401 -- likewise
    yield "at_s,measured_rad_s,simulated_rad_s"
    simulated = series.measured - fit.residuals
    for at, one, other in zip(series.at, series.measured, simulated, strict=True):
        yield f"{at:.9f},{float(one)!r},{float(other)!r}"
