"""A board of another package: what its definition may leave out, and how a broken one is named."""

import importlib
import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.board.rigs import has_rig, rig_for
from firmware_runtime.board.robot import Robot, absent_lines
from firmware_runtime.board.setting_descriptions import described
from firmware_runtime.cli.main import main
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.executive.clocks import VirtualClock, WorldClock
from firmware_runtime.runs.start import start_session
from tests.support.installed_here import installed_here

TOML = """board = "heron"
description = "nothing but a model"
[buses.i2c1]
device = "/dev/i2c-1"
speed_hz = 100_000
"""
SMALL = """
from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.robot import Robot
from firmware_runtime.board.settings import BoardSettings
from firmware_runtime.devs.coupled import Coupled

class HeronSettings(BoardSettings, frozen=True, kw_only=True):
    pass

def build(settings, lines):
    bus = lines.buses["i2c1"]
    return Robot(model=Coupled("heron"), probe=(), stop=())
"""
OBJECT = SMALL + "\nBOARD = BoardDefinition(settings=HeronSettings, build=build)\n"
MODULE = SMALL + "\nSETTINGS = HeronSettings\n"
BOUNDS, BUILD = SMALL.split("    pass\n")
BOUNDS = "from typing import Annotated\nfrom msgspec import Meta\n" + BOUNDS
BOUND_MODULE = BUILD + "\nSETTINGS = HeronSettings\n"
BOARD = "[firmware_runtime.boards]\nheron = heron.definition:BOARD\n"
BARE = "[firmware_runtime.boards]\nheron = heron.definition\n"
RIG = "[firmware_runtime.rigs]\nheron = heron.rig:HeronRig\n"


class Heron:
    """Installs the package of the board `heron`."""

    def __init__(self, site: Path, stack: ExitStack) -> None:
        self._site = site
        self._stack = stack

    def install(
        self, definition: str, entries: str = BOARD, rig: str = "", provider: str | None = None
    ) -> Path:
        """Write and install it; returns its folder."""
        files = {"board.toml": TOML, "definition.py": definition, "rig.py": rig}
        self._site = self._site.with_name(f"{self._site.name}-{provider}")
        return self._stack.enter_context(
            installed_here(self._site, "heron", files, entries, provider=provider)
        )


@pytest.fixture
def heron(tmp_path: Path) -> Iterator[Heron]:
    with ExitStack() as stack:
        yield Heron(tmp_path / "site", stack)


@pytest.mark.parametrize(
    ("definition", "entries"), [(OBJECT, BOARD), (OBJECT, BARE), (MODULE, BARE)]
)
def test_settings_and_build_are_enough(heron: Heron, definition: str, entries: str) -> None:
    heron.install(definition, entries)
    assert "heron" in kinds.names()
    board = registry.load("heron")
    assert (board.devices, board.retunable, board.doubles_run_s) == ((), (), 10.0)
    assert (board.event_model, board.warnings) == (None, [])
    assert board.loads["i2c1"].utilisation == 0.0


def test_a_module_may_spell_out_what_an_object_states(heron: Heron) -> None:
    heron.install(MODULE + "RETUNABLE = ('a.b',)\nDOUBLES_RUN_S = 3.0\n", BARE)
    board = registry.load("heron")
    assert (board.retunable, board.doubles_run_s) == (("a.b",), 3.0)


def test_a_robot_of_two_kinds_of_names_is_read_from_a_file_of_its_own(
    heron: Heron, tmp_path: Path
) -> None:
    heron.install(OBJECT)
    (tmp_path / "left.toml").write_text(f'name = "left"\n{TOML}')
    board = registry.load(str(tmp_path / "left.toml"))
    assert (board.name, board.kind) == ("left", "heron")


BROKEN = {
    "no such object": ("", BOARD),
    "not a board": ("BOARD = 3", BOARD),
    "an error of syntax": ("def", BOARD),
    "an import that fails": ("import no_such_module", BOARD),
    "an import that exits": ("raise SystemExit(0)", BOARD),
    "no such module": (OBJECT, BOARD.replace("definition", "elsewhere")),
    "no such package": (OBJECT, BOARD.replace("heron.definition", "no_such_package.definition")),
    "a module without settings": (SMALL, BARE),
    "a module without build": (MODULE.replace("build", "make"), BARE),
    "settings that are none": (MODULE + "SETTINGS = dict", BARE),
    "settings without buses": (
        MODULE + "import msgspec\nclass Bare(msgspec.Struct):\n    board: str\nSETTINGS = Bare",
        BARE,
    ),
    "faults that are no function": (MODULE + "faults = []", BARE),
    "faults that raise": (MODULE + "def faults(settings):\n    return 1 / 0", BARE),
    "faults that are a text": (MODULE + "def faults(settings):\n    return 'abc'", BARE),
    "faults that are nothing": (MODULE + "def faults(settings):\n    pass", BARE),
    "a build that raises": (MODULE + "def build(settings, lines):\n    return 1 / 0", BARE),
    "a robot that shows a text": (OBJECT.replace("stop=()", "stop=(), shown='yaw'"), BOARD),
    "a robot whose warning is a text": (OBJECT.replace("stop=()", "stop=(), warnings='no'"), BOARD),
    "devices that raise": (MODULE + "def devices(settings):\n    return settings.imu", BARE),
    "settings of bounds that contradict each other": (
        BOUNDS + "    speed: Annotated[Annotated[float, Meta(ge=0)], Meta(gt=0)]\n" + BOUND_MODULE,
        BARE,
    ),
    "settings whose bound is of another type": (
        BOUNDS + "    speed: Annotated[str, Meta(ge=0)]\n" + BOUND_MODULE,
        BARE,
    ),
    "settings of a type that is not there": (
        "from __future__ import annotations\n" + BOUNDS + "    speed: Spede\n" + BOUND_MODULE,
        BARE,
    ),
    "settings of two lists in one": (
        BOUNDS + "    speed: list[int] | tuple[str, ...]\n" + BOUND_MODULE,
        BARE,
    ),
    "an entry point that names no module": (OBJECT, BOARD.replace("heron.d", "not a module! d")),
    "retunable that is one key": (MODULE + "RETUNABLE = 'imu.kp'", BARE),
    "retunable that is no list": (MODULE + "RETUNABLE = 5", BARE),
    "a run on doubles of no length": (MODULE + "DOUBLES_RUN_S = 'long'", BARE),
    "loads that are no table": (MODULE + "def loads(settings):\n    return [3]", BARE),
    "loads that raise": (MODULE + "def loads(settings):\n    raise KeyError('i2c9')", BARE),
}


@pytest.mark.parametrize(("definition", "entries"), BROKEN.values(), ids=BROKEN)
def test_a_broken_definition_is_one_sentence_with_its_packages_name(
    heron: Heron, capsys: pytest.CaptureFixture[str], definition: str, entries: str
) -> None:
    heron.install(definition, entries)
    assert main(["check", "heron"]) == 2
    said = capsys.readouterr().err
    assert "of the package heron" in said
    assert "Traceback" not in said
    assert registry.load("tachobot").name == "tachobot"


def refused(call: Callable[[], object]) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        call()
    return caught.value


def test_where_in_a_package_it_broke_is_said_and_the_others_are_listed(
    heron: Heron, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = heron.install("import msgspec\n\nraise OSError('no file')", BOARD)
    (fault, *_) = refused(lambda: registry.load("heron")).faults
    assert f"{folder / 'definition.py'}, line 3" in fault
    assert main(["show"]) == 2
    printed = capsys.readouterr()
    assert "tachobot" in printed.out
    assert "of the package heron" in printed.err


DRIVEN = """
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.esc import Esc, EscSettings

def build(settings, lines):
    model = Coupled("heron")
    chip = Pca9685(lines.buses["i2c1"])
    model.add(Esc("wing", chip, EscSettings(0, 50.0, 1000.0, 2000.0, 0), lines.interlock))
    return Robot(model=model, probe=(), stop=())
"""
SHY = """
from firmware_runtime.devs.atomic import Atomic

class Shy:
    @property
    def __class__(self):
        raise RuntimeError("no")
"""
MIND = "Coupled('heron')\n    model.add(Atomic('mind')).shy = Shy()"
"""Beside an object that does not say its class, who drives is found too."""
UNSTOPPED = "stop: wing may drive"


@pytest.mark.parametrize(
    ("build", "fault"),
    [
        *(
            (f"def build(settings, lines):\n    {body}\n", "")
            for body in (
                "raise TypeError('no')",
                "return None",
                "return settings.wheels",
                "return Robot(model=3, probe=(), stop=())",
                "return Robot(model=Coupled('heron'), probe=(3,), stop=())",
                "return Robot(model=Coupled('heron'), probe=(), stop=None)",
            )
        ),
        pytest.param(DRIVEN, UNSTOPPED, id="what drives and nothing would switch off"),
        pytest.param(SHY + DRIVEN.replace('Coupled("heron")', MIND), UNSTOPPED, id="shy"),
    ],
)
def test_a_build_that_breaks_is_named(heron: Heron, build: str, fault: str) -> None:
    heron.install(f"{MODULE}\n{build}", BARE)
    board = registry.load("heron")
    error = refused(lambda: board.build(absent_lines(board.settings.buses)))
    assert error.where == "board heron of the package heron"
    assert fault in error.faults[0]


@pytest.mark.parametrize("defect", [lambda: 1 / 0, lambda: 3])
def test_a_result_or_a_probe_that_breaks_is_named(defect: Callable[[], dict[str, object]]) -> None:
    wheels: dict[str, None] = {}
    model = Coupled("heron")
    robot = Robot(model=model, probe=(lambda: wheels["left"],), stop=(), result=defect)
    result, probe = refused(robot.own_result), refused(robot.find_chips)
    assert result.where == probe.where == "robot heron"
    assert result.faults[0].startswith("result: ")
    assert probe.faults == ("probe: KeyError: 'left'",)


def test_a_file_of_another_kind_than_its_package_or_its_name_is_refused(
    heron: Heron, tmp_path: Path
) -> None:
    folder = heron.install(OBJECT)
    (tmp_path / "board.toml").write_text(f'name = "tachobot"\n{TOML}')
    (fault,) = refused(lambda: registry.load(str(tmp_path))).faults
    assert fault.startswith("name: 'tachobot'")
    (folder / "board.toml").write_text(TOML.replace("heron", "tachobot"))
    expected = "board: 'tachobot': expected 'heron', as its entry point is called"
    assert refused(lambda: registry.load("heron")).faults == (expected,)


QUITTING = """
class Quitting(Atomic):
    def initialize(self):
        self.hold_in("quitting", 0)

    def internal(self):
        raise SystemExit(0)

def build(settings, lines):
    return Robot(model=Quitting("quitting"), probe=(), stop=(lambda: print("off"),))
"""


def test_a_model_that_quits_the_program_is_a_failed_run_with_outputs_off(
    heron: Heron, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    imported = "from firmware_runtime import Atomic\n"
    folder = heron.install(imported + MODULE + QUITTING, BARE)
    (folder / "board.toml").write_text(TOML.partition("[")[0])
    statistics = tmp_path / "heron.stats"
    assert main(["run", "heron", "--for", "1", "--statistics", str(statistics)]) == 1
    kept = {each.suffix for each in tmp_path.glob("heron.*")}
    # no settings to switch off by: outputs are off
    assert kept == {".recording", ".stats"}
    printed = capsys.readouterr()
    assert "off" in printed.out.splitlines()
    assert "quitting" in printed.err
    assert "SystemExit(0)" in printed.err


def test_a_kind_that_two_packages_provide_is_refused_in_a_sentence_that_names_both(
    heron: Heron, capsys: pytest.CaptureFixture[str]
) -> None:
    heron.install(OBJECT)
    heron.install(OBJECT, provider="heron")  # on the path twice, it is not its own rival
    assert registry.load("heron").kind == "heron"
    heron.install(OBJECT, provider="egret")
    assert "egret and heron" in refused(lambda: registry.load("heron")).faults[0]
    for words in (["check", "heron"], ["run", "heron", "--doubles"]):
        assert main(words) == Status.BAD_INPUT
        (said,) = capsys.readouterr().err.splitlines()
        assert "egret and heron both provide it; expected one of them uninstalled" in said


def test_without_a_rig_every_use_of_doubles_says_so_and_no_load_is_known(
    heron: Heron, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    heron.install(OBJECT)
    assert not has_rig(registry.load("heron"))
    assert main(["check", "heron"]) == 0
    said = capsys.readouterr().out
    assert "i2c1: no load is stated at 100000 Hz" in said
    assert "whether 10 min fit is not known, for no load of i2c1 is stated" in said
    assert "%" not in said
    for words in (
        ["run", "heron", "--doubles"],
        ["doubles", "serve", "heron", "--socket", str(tmp_path / "socket")],
        ["probe", "--doubles", "heron"],
    ):
        assert main(words) == 2, words
        assert "has no rig" in capsys.readouterr().err


# Rigs ---------------------------------------------------------------------------------------------


RIG_OF_NOTHING = """
from sim_doubles.i2c_bus import I2cBusDouble

class HeronRig:
    ports = outputs = {}
    enable = shown = None
    def __init__(self, settings, clock):
        self.buses = {"i2c1": I2cBusDouble("i2c1", clock, ())}
    def attach(self, robot):
        pass
    def result(self, elapsed, own):
        return dict(own)
    def catch_up(self):
        pass
    def levels(self, at):
        return {}
    def next_change_at(self, at):
        return at
"""
WITHOUT_A_BUS = RIG_OF_NOTHING.replace('{"i2c1": I2cBusDouble("i2c1", clock, ())}', "{}")
RUN = ["run", "heron", "--doubles", "--clock", "virtual", "--for", "1"]


@pytest.mark.parametrize(
    ("rig", "fault"),
    [
        *((rig, "") for rig in ("", "HeronRig = 3", "1 / 0", "class HeronRig:\n    pass")),
        *(
            (f"class HeronRig:\n    def __init__(self, settings, clock):\n        {body}", "")
            for body in ("settings.world", "pass")
        ),
        (WITHOUT_A_BUS, "i2c1"),
    ],
)
def test_a_broken_rig_is_named(heron: Heron, rig: str, fault: str) -> None:
    heron.install(OBJECT, BOARD + RIG, rig)
    error = refused(lambda: rig_for(registry.load("heron"), WorldClock()))
    assert error.where == "rig heron of the package heron"
    assert fault in error.faults[0]


def test_a_rig_may_show_nothing(heron: Heron) -> None:
    heron.install(OBJECT, BOARD + RIG, RIG_OF_NOTHING)
    session = start_session(
        registry.load("heron"), VirtualClock(), doubles=True, statistics_path=None
    )
    assert session.executive.run(SECOND).error is None
    assert (session.shown, session.result()) == (None, {})
    session.close()


@pytest.mark.parametrize(
    ("defect", "named"),
    [
        *(
            (
                f"@property\n    def {part}(self):\n        return 1 / 0",
                f"{part}: ZeroDivisionError",
            )
            for part in ("attach", "shown", "result", "outputs")
        ),
        ("buses = None", "buses None"),
        ("buses = property(lambda self: {'i2c1': 3})", "buses {'i2c1': 3}"),
        ("ports = []", "ports []"),
        ("enable = 3", "enable 3"),
        ("outputs = [3]", "outputs: [3]"),
        ("def result(self, elapsed, own):\n        return [3]", "result: [3]"),
        ("shown = 'yaw'", "shown: 'yaw'; expected an OutPort"),
    ],
)
def test_a_part_of_a_rig_that_breaks_or_is_of_another_type_is_named(
    heron: Heron, capsys: pytest.CaptureFixture[str], defect: str, named: str
) -> None:
    rig = RIG_OF_NOTHING.replace("        self.buses =", "        buses =")
    lines = rig if defect.startswith("buses") else RIG_OF_NOTHING
    heron.install(OBJECT, BOARD + RIG, f"{lines}\n    {defect}\n")
    assert main(RUN) == 2
    said = capsys.readouterr().err
    assert "rig heron of the package heron" in said
    assert named in said


def test_a_result_is_json_whatever_it_holds(
    heron: Heron, capsys: pytest.CaptureFixture[str]
) -> None:
    result = "    def result(self, elapsed, own):\n        return {'x': float('nan'), 'y': {1j}}\n"
    heron.install(OBJECT, BOARD + RIG, f"{RIG_OF_NOTHING}\n{result}")
    assert main([*RUN, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["result"] == {"x": "nan", "y": "{1j}"}


RESULT = "    def result(self, elapsed, own):\n        return {'height_m': 2.5}\n"


def in_words(function: str) -> str:
    """A definition whose robot says by this function what it did."""
    return OBJECT.replace("BoardDefinition(", f"BoardDefinition(result_text={function}, ")


def test_a_run_ends_in_the_words_of_the_board(
    heron: Heron, capsys: pytest.CaptureFixture[str]
) -> None:
    words = in_words("lambda result: f\"it flew at\\n {result['height_m']} m\"")
    heron.install(words, BOARD + RIG, RIG_OF_NOTHING + RESULT)
    assert main(RUN) == 0
    _opening, _blank, did, *_ = capsys.readouterr().out.splitlines()
    assert did == "it flew at 2.5 m"


@pytest.mark.parametrize("rig", [RIG_OF_NOTHING, RIG_OF_NOTHING + RESULT], ids=["none", "result"])
def test_without_any_it_says_how_long_it_ran_and_what_is_known(
    heron: Heron, capsys: pytest.CaptureFixture[str], rig: str
) -> None:
    heron.install(OBJECT, BOARD + RIG, rig)
    assert main(RUN) == 0
    _opening, _blank, did, *_ = capsys.readouterr().out.splitlines()
    known = ": height_m 2.5" if rig.endswith(RESULT) else ""
    assert did == f"heron ran for 1.00 s{known}"


@pytest.mark.parametrize(
    ("function", "named"),
    [("lambda result: result['depth_m']", "KeyError: 'depth_m'"), ("lambda result: 3", "3")],
)
def test_words_that_break_cost_nothing_else_and_are_named(
    heron: Heron, capsys: pytest.CaptureFixture[str], function: str, named: str
) -> None:
    heron.install(in_words(function), BOARD + RIG, RIG_OF_NOTHING + RESULT)
    assert main(RUN) == 2
    said = capsys.readouterr()
    for text in (said.out, said.err):
        assert f"board heron of the package heron: result_text: {named}" in text.replace(
            "returned ", ""
        )
    assert "heron ran for 1.00 s: height_m 2.5" in said.out


BARE_TABLES = """
class MotorTable(Settings, frozen=True):
    speed: float
    name: Annotated[str, Meta(description="What it is called.")]

class LampTable(Settings, frozen=True):
    '''The lamp.'''
    volts: float
"""


def test_a_setting_without_a_description_has_its_table_s_and_no_other_class_s(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    imports = "from typing import Annotated\nfrom msgspec import Meta\n"
    source = f"{imports}from firmware_runtime.board.settings import Settings\n{BARE_TABLES}"
    (tmp_path / "bare_tables.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    tables = importlib.import_module("bare_tables")
    found = described(
        {"motor": tables.MotorTable(1.0, "x"), "lamp": tables.LampTable(2.0)}, ["*.*"]
    )
    texts = {key: each.text for key, each in found.items()}
    assert texts == {
        "motor.speed": "",
        "motor.name": "What it is called.",
        "lamp.volts": "The lamp.",
    }
