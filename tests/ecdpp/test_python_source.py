"""Python source made of a model file builds the same model."""

import ast
from contextlib import suppress
from pathlib import Path

import pytest
from firmware_boards.detective.detective import MODEL_FILE, Detective
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import SECOND
from firmware_runtime.ecdpp.atomic_class import AtomicClass
from firmware_runtime.ecdpp.event_file import parse_events
from firmware_runtime.ecdpp.experiment import run_events
from firmware_runtime.ecdpp.model_file import parse_file
from firmware_runtime.ecdpp.python_names import camel_case, snake_case
from firmware_runtime.ecdpp.python_source import imported_source, python_source
from firmware_runtime.errors import ConfigError
from tests.ecdpp.test_model_file import CLASSES, TWO_RELAYS, Relay
from tests.support import figure_6
from tests.support.ecdpp_round_trip import described, executed


def test_the_detectives_file_becomes_source_of_the_same_model(tmp_path: Path) -> None:
    model = executed(imported_source(MODEL_FILE), tmp_path / "mine.py", "Top")
    assert described(model) == described(Detective())
    events = parse_events(figure_6.EVENTS, "figure 6", model)
    assert "".join(f"{line}\n" for line in run_events(model, events)) == figure_6.OUTPUTS


def test_names_that_collide_or_mean_something_are_changed_in_python_only(tmp_path: Path) -> None:
    text = (
        "[top]\ncomponents : class self@Relay Relay\nin : in add\nout : components\n"
        "link : in In@self\nlink : add In@self\nlink : Out@self components\n"
        "[class]\ncomponents : print@Relay\nin : name\nlink : name In@print\n"
        "[Relay]\ncomponents : import@Relay\nout : couple\nlink : Out@import couple"
    )
    read = parse_file(text, "names.ma", CLASSES)
    model = executed(python_source(read, "names.ma"), tmp_path / "names.py", "Top")
    assert described(model) == described(read.model)


def test_arguments_are_those_of_the_file() -> None:
    source = python_source(parse_file(TWO_RELAYS, "two.ma", CLASSES), "two.ma")
    assert 'Relay("First", hold=20 * MILLISECOND, factor=2.5)' in source
    assert 'Relay("last", hold=SECOND)' in source
    assert source.startswith('"""The model of two.ma, as a class for')


class relay(Relay):  # noqa: N801 -- as some people call theirs
    pass


def test_a_component_that_is_called_as_its_class_does_not_hide_it(tmp_path: Path) -> None:
    read = parse_file("[top]\ncomponents : relay@relay", "x.ma", {"relay": AtomicClass(relay)})
    model = executed(python_source(read, "x.ma"), tmp_path / "mine.py", "Top")
    assert isinstance(model.components["relay"], relay)


@pytest.mark.slow
@given(st.lists(st.from_regex(r"[\w-]{1,3}", fullmatch=True), min_size=6, max_size=6))
def test_source_of_any_names_builds_the_same_model(
    tmp_path_factory: pytest.TempPathFactory, names: list[str]
) -> None:
    a, b, c, start, way, end = names
    text = (
        f"[top]\ncomponents : {a} {b}@Relay\nin : {start}\nout : {end}\nlink : {start} {way}@{a}\n"
        f"link : Out@{b} {end}\n[{a}]\ncomponents : {c}@Relay\nin : {way}\nlink : {way} In@{c}\n"
    )
    with suppress(ConfigError):
        read = parse_file(text, "any.ma", CLASSES)
        path = tmp_path_factory.mktemp("source") / "any.py"
        assert described(executed(python_source(read, "any.ma"), path, "Top")) == described(
            read.model
        )


def test_a_file_name_does_not_end_the_docstring() -> None:
    read = parse_file("[top]\nin : a", "x.ma", CLASSES)
    source = python_source(read, 'x"""+y\\.ma')
    docstring = ast.get_docstring(ast.parse(source))
    assert docstring is not None
    assert docstring.startswith('The model of x"""+y\\.ma, as')


def test_a_class_that_cannot_be_imported_is_refused() -> None:
    classes = {"Relay": AtomicClass(lambda name: Relay(f"{name}_of_no_name"))}
    with pytest.raises(ConfigError, match=r"top\.a_of_no_name: .*<lambda> cannot be imported"):
        python_source(parse_file("[top]\ncomponents : a@Relay", "x.ma", classes), "x.ma")


@pytest.mark.parametrize(
    ("name", "snake", "camel"),
    [
        ("radarController", "radar_controller", "RadarController"),
        ("RS_In1", "rs_in1", "RsIn1"),
        ("BUF-PROC", "buf_proc", "BufProc"),
        ("in", "in_", "In"),
        ("print", "print_", "Print"),
        ("2nd", "_2nd", "Model2nd"),
        ("none", "none", "ModelNone"),
        ("m²", "m2", "M2"),
        ("𐄇", "_", "_"),
    ],
)
def test_names(name: str, snake: str, camel: str) -> None:
    assert (snake_case(name), camel_case(name)) == (snake, camel)


def test_skeletons_stand_in_for_the_classes_that_nobody_has(tmp_path: Path) -> None:
    path = tmp_path / "factory.ma"
    path.write_text(
        "[top]\ncomponents : q@Queue class@my-Server p@my-server s@Motor\nin : in\nout : out\n"
        "Link : in in@q\nLink : done@class Done@q\nLink : out@q in@class\nLink : out@class out\n"
        "[q]\npreparation : 00:00:75:000\nsize : 4\nlaw : poisson\n[p]\nmean : 0.5\n"
        "[class]\nmean : 3\nname : 7\n",
        encoding="utf-8",
    )
    with pytest.raises(ConfigError, match="unknown class 'Queue'"):
        imported_source(path)
    source = imported_source(path, with_skeletons=True)
    for argument in ("preparation: int = 75 * SECOND", "size: int = 4", "law: str = 'poisson'"):
        assert f"        {argument},\n" in source
    model = executed(source, tmp_path / "factory.py", "Top")
    classes = {type(each).__name__ for each in model.components.values()}
    assert classes == {"Queue", "MyServer", "Motor"}
    queue, server = model.components["q"], model.components["class"]
    assert (list(queue.in_ports), list(queue.out_ports)) == (["in", "Done"], ["out"])
    assert vars(queue)["preparation"] == 75 * SECOND
    assert (vars(server)["mean"], vars(model.components["p"])["mean"]) == (3, 0.5)
    assert run_events(model, parse_events("00:00:01:00 in 1", "one", model), checked=True) == []
