import json

from hypothesis import given
from hypothesis import strategies as st
from msgspec import convert

from firmware_runtime.statistics.fault_table import MODEL_CELLS
from firmware_runtime.statistics.figures import Activations, BusFigures
from firmware_runtime.statistics.histogram import CELLS
from firmware_runtime.statistics.layout import (
    BUS,
    DEADLINE,
    MODEL,
    REASON,
    RUN,
    SERIAL,
    TIMELINE,
    Layout,
)
from firmware_runtime.statistics.rows import BusRow, ModelRow, WorstRow, as_counted, counters

NAMES = st.lists(st.sampled_from(["imu", "compass", "controller.yaw"]), max_size=4).map(tuple)
LAYOUTS = st.builds(Layout, NAMES, NAMES, NAMES, NAMES, st.integers(1, 20), NAMES, ports=NAMES)


@given(LAYOUTS)
def test_blocks_follow_each_other_and_fill_the_file(layout: Layout) -> None:
    at = len(RUN) + CELLS
    for index in range(len(layout.models)):
        assert layout.model(index) == at
        assert layout.lateness(index) == slice(at + len(MODEL), at + len(MODEL) + CELLS)
        assert layout.step(index).start == layout.lateness(index).stop
        at = layout.step(index).stop
    for index in range(len(layout.buses)):
        assert layout.bus(index) == at
        at += len(BUS)
    for index in range(len(layout.deadlines)):
        assert layout.deadline(index) == at
        at += len(DEADLINE)
    for index in range(len(layout.ports)):
        assert layout.port(index) == at
        at += len(SERIAL)
    assert layout.place(0) == at
    assert layout.reason.start == at + layout.worst * layout.place_cells
    assert layout.timeline.start == layout.reason.stop == layout.reason.start + REASON
    assert layout.faults.start == layout.timeline.stop == layout.timeline.start + TIMELINE
    assert layout.cells == layout.faults.stop
    assert layout.cells - layout.faults.start == len(layout.fault_models) * MODEL_CELLS


def test_what_only_grows_is_said_where_a_field_is_defined() -> None:
    assert counters(ModelRow) == [*Activations.__struct_fields__, "irregular", "reactions"]
    assert counters(BusRow) == list(BUS)
    assert counters(WorstRow) == []


def test_a_field_with_the_name_of_a_figure_is_that_figure() -> None:
    row = BusRow(transactions=1, bytes=2, errors=3, retries=4, busy_ns=5)
    shown = {"transactions": 1, "bytes": 2, "errors": 3, "retries": 4}
    assert as_counted(row, BusFigures) == shown


@given(LAYOUTS)
def test_it_survives_the_header(layout: Layout) -> None:
    description = json.loads(json.dumps(layout.describe()))
    assert convert(description, Layout) == layout


def test_its_description_places_every_block_for_programs_that_do_not_know_it() -> None:
    layout = Layout(
        models=("imu", "compass"), buses=("i2c1",), deadlines=("yaw",), ports=("a", "b")
    )
    description = layout.describe()
    block = description["model_block"]
    assert block["at"] + block["stride"] * 1 == layout.model(1)
    assert description["bus_block"]["at"] == layout.bus(0)
    assert description["deadline_block"]["at"] == layout.deadline(0)
    block = description["port_block"]
    assert block["at"] + block["stride"] == layout.port(1)
    assert description["worst_block"]["at"] == layout.place(0)
    assert description["timeline_block"]["at"] == layout.timeline.start
    assert description["fault_block"]["at"] == layout.faults.start
    assert description["cells"] == layout.cells


def test_a_file_from_before_faults_were_counted_has_none() -> None:
    description = Layout(models=("imu",)).describe()
    del description["fault_models"]
    assert convert(description, Layout) == Layout(models=("imu",))
