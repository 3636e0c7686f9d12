"""What a definition names and its robot does not have is told by `check`."""

from pathlib import Path

import pytest
from msgspec.structs import replace

from firmware_runtime.board import registry
from firmware_runtime.board.experiments import OwnExperiment, PidLoop, Plant, Signal, StepExperiment
from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.board.settings import BoardSettings
from firmware_runtime.cli import main
from firmware_runtime.runs.unknown_names import may_have, unknown_names

EXAMPLES = Path(__file__).parents[2] / "examples"
STEP = StepExperiment(
    title="Step",
    port="yaw_reference",
    begin=0.0,
    end=1.0,
    quantity="yaw",
    unit="rad",
    answer="world.yaw_rad",
)
LOOP = PidLoop(
    kp="controller.yaw.kp",
    ki="controller.yaw.ki",
    kd="controller.yaw.kd",
    gain=lambda _: 1.0,
    limit=lambda _: 1.0,
    period_s=lambda _: 0.01,
)
PLANT = Plant(
    title="the platform",
    structure="rotation",
    input=Signal(("controller.forces",), {"f1": 1.0}),
    output=Signal(("imu.sample",), {"rate.2": 1.0}),
    measures="rate",
    loop=LOOP,
)


@pytest.fixture
def board() -> Board:
    """TachoBot's, with a step and a plant that are sound."""
    found = registry.load("tachobot")
    return replace(found, experiments={"step": STEP}, plant=PLANT)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["tachobot", "detective", EXAMPLES / "balancing/balancing", EXAMPLES / "pan_tilt/pan_tilt"],
)
def test_boards_that_come_with_the_project_name_nothing_in_vain(name: str | Path) -> None:
    assert list(unknown_names(registry.load(str(name)))) == []


@pytest.mark.parametrize(
    ("experiment", "said"),
    [
        (replace(STEP, port="yaw"), "port: 'yaw': no input port of the top model; expected one"),
        (replace(STEP, answer="world.yaw"), "answer: 'world.yaw': the model on its doubles has no"),
        (replace(STEP, beside={"Pitch": "world.pitch"}), "beside: 'world.pitch': the model on its"),
        (replace(STEP, settings={"world.mas": 1}), "settings: world.mas: unknown key"),
        (
            OwnExperiment(title="Own", run="tachobot_yaw.step:run"),
            "run: no module tachobot_yaw.step; expected it",
        ),
    ],
)
def test_an_experiment_names_what_is_there(
    board: Board, experiment: StepExperiment | OwnExperiment, said: str
) -> None:
    [found] = unknown_names(replace(board, experiments={"step": experiment}))
    assert found.startswith(f"experiments.step.{said}")


@pytest.mark.parametrize(
    ("plant", "said"),
    [
        (replace(PLANT, input=Signal(("x", "y.z"), {"": 1.0})), "plant.input: x, y.z: the model"),
        (
            replace(PLANT, input=Signal(("controller.forces",), {"f5": 1.0})),
            "plant.input: 'f5': a Forces has no such number; expected one of f1, f2, f3, f4",
        ),
        (replace(PLANT, loop=replace(LOOP, kp="yaw.kp")), "plant.loop.kp: 'yaw.kp': no gain of"),
    ],
)
def test_a_plant_names_what_is_there(board: Board, plant: Plant, said: str) -> None:
    [found] = unknown_names(replace(board, plant=plant))
    assert found.startswith(said)


def test_a_gain_that_no_file_can_have_is_named(board: Board) -> None:
    gains = ("controller.*.kp", "controller.x.kp", "controller.yaw.kpp", "controller.yaw")
    found = [*unknown_names(replace(board, retunable=gains, plant=None))]
    assert [each.partition(": no file")[0] for each in found] == [
        "retunable: 'controller.yaw.kpp'",
        "retunable: 'controller.yaw'",
    ]


def test_a_key_of_a_table_that_the_file_names_is_one_that_it_may_have() -> None:
    assert may_have(BoardSettings, "buses.i2c7.speed_hz")
    assert may_have(BoardSettings, "output_enable.line"), "of a table that may be left out"
    assert not may_have(BoardSettings, "buses.i2c7.speed")


def test_a_value_that_cannot_cross_the_cut_is_named(board: Board) -> None:
    def build(lines: Lines) -> Robot:
        robot = board.build(lines)
        components = robot.model.components
        components["imu"].out_ports["sample"].type = object
        components["controller"].in_ports["sample"].type = object
        return robot

    [found] = unknown_names(replace(board, build=build))
    assert found.startswith("roles: imu.sample: its values cannot cross a link")


def test_check_warns_of_it_and_calls_the_board_sound(
    board: Board, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    told = replace(board, retunable=("controller.x.kx",), plant=None)
    monkeypatch.setattr("firmware_runtime.cli.commands.check.chosen_board", lambda *_: told)
    assert main.main(["check", "tachobot"]) == 0
    assert "  warning: retunable: 'controller.x.kx': no file" in capsys.readouterr().out


def test_a_deadline_with_two_wrong_ends_has_two_faults(capsys: pytest.CaptureFixture[str]) -> None:
    wrong = 'deadlines=[{source="imu.x", actuator="y", within_us=1.0}]'
    assert main.main(["check", "tachobot", "--set", wrong]) == 2
    said = capsys.readouterr().err
    assert "deadlines.source: 'imu.x'" in said
    assert "deadlines.actuator: 'y'" in said


def test_a_deadline_of_a_misspelt_model_names_the_model(capsys: pytest.CaptureFixture[str]) -> None:
    wrong = 'deadlines=[{source="imu.sample", actuator="thrust_pear", within_us=1.0}]'
    assert main.main(["check", "tachobot", "--set", wrong]) == 2
    assert "did you mean thrust_pairs?" in capsys.readouterr().err


def test_a_deadline_of_a_misspelt_port_names_the_port(capsys: pytest.CaptureFixture[str]) -> None:
    wrong = 'deadlines=[{source="imu.sampel", actuator="thrust_pairs", within_us=1.0}]'
    assert main.main(["check", "tachobot", "--set", wrong]) == 2
    assert "did you mean imu.sample?" in capsys.readouterr().err
