from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.tree import tree
from tests.support.devs_models import Clock, Echo, Log


def example() -> Coupled:
    robot, controller = Coupled("robot"), Coupled("controller")
    clock, log = robot.add(Clock("clock", 5)), robot.add(Log("log"))
    robot.add(controller)
    echo = controller.add(Echo("echo"))
    inlet, outlet = controller.in_port("in", int), controller.out_port("out", int)
    controller.couple(inlet, echo.inlet)
    controller.couple(echo.outlet, outlet)
    robot.couple(clock.ticks, inlet)
    robot.couple(outlet, log.values)
    return robot


def test_a_tree_shows_components_ports_with_types_and_couplings_in_order_of_declaration() -> None:
    assert tree(example()) == (
        "robot (Coupled)\n"
        "  clock (Clock)\n"
        "    ticks: int ->\n"
        "  log (Log)\n"
        "    -> values: int\n"
        "  controller (Coupled)\n"
        "    -> in: int\n"
        "    out: int ->\n"
        "    echo (Echo)\n"
        "      -> in: int\n"
        "      out: int ->\n"
        "    in -> echo.in\n"
        "    echo.out -> out\n"
        "  clock.ticks -> controller.in\n"
        "  controller.out -> log.values"
    )


def test_couplings_can_be_left_out() -> None:
    lines = tree(example(), couplings=False).splitlines()
    assert "  clock.ticks -> controller.in" not in lines
    assert "      out: int ->" in lines


def test_a_part_is_shown_by_itself() -> None:
    echo = example().components["controller"]
    assert tree(echo).splitlines()[0] == "controller (Coupled)"
    assert tree(echo).splitlines()[-1] == "  echo.out -> out"
