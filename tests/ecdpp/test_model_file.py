from pathlib import Path

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.ecdpp.atomic_class import AtomicClass
from firmware_runtime.ecdpp.event_file import Event
from firmware_runtime.ecdpp.experiment import run_events
from firmware_runtime.ecdpp.file_text import Warnings
from firmware_runtime.ecdpp.model_file import parse_model, read_model
from firmware_runtime.errors import ConfigError


class Relay(Atomic):
    """Passes on the last number after a time, multiplied."""

    def __init__(self, name: str, hold: int = MILLISECOND, factor: float = 1.0) -> None:
        super().__init__(name)
        if factor == 0:
            raise ValueError("factor 0, expected another number")
        self.entrance = self.in_port("In", float)
        self.count = self.in_port("count", int)
        self.result = self.out_port("Out", float)
        self.whole = self.out_port("whole", int)
        self.hold, self.factor = hold, factor
        self.last = 0.0

    def external(self, elapsed: int) -> None:
        assert elapsed >= 0
        self.last = self.entrance[-1]
        self.hold_in("holding", self.hold)

    def output(self) -> None:
        self.result.send(self.last * self.factor)
        self.whole.send(round(self.last))


CLASSES = {"Relay": AtomicClass(Relay, {"holdTime": "hold"}, {"factor": "factor"})}

TWO_RELAYS = """
% two relays, one in a model of its own
[Top]
components : inner last@Relay
in : Start
out : Result Whole
LINK : start way@INNER
Link : way_out@inner in@last
link : OUT@Last Result   # the last one's
link : whole@last Whole

[inner]
components : First@relay
in : Way
out : Way_out
Link : Way In@first
Link : Out@first Way_out

[first]
holdtime : 00:00:00:20
factor : 2.5

[last]
HoldTime : 00:00:01:000
"""


def parse(text: str) -> Coupled:
    return parse_model(text, "test.ma", CLASSES)


def faults(text: str) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        parse(text)
    assert caught.value.where == "test.ma"
    return list(caught.value.faults)


def test_a_model_file_builds_a_model_that_runs() -> None:
    lines = run_events(parse(TWO_RELAYS), [Event(0, "Start", 4.0)], checked=True)
    assert [str(line) for line in lines] == ["00:00:01:020 result 10", "00:00:01:020 whole 10"]


def test_names_are_those_of_the_declarations() -> None:
    model = parse(TWO_RELAYS)
    assert model.name == "Top"
    assert list(model.components) == ["inner", "last"]
    assert list(model.out_ports) == ["Result", "Whole"]
    inner = model.components["inner"]
    assert isinstance(inner, Coupled)
    assert list(inner.components) == ["First"]


def test_a_coupled_port_takes_the_type_of_what_it_is_linked_to() -> None:
    model = parse(TWO_RELAYS)
    assert model.in_ports["Start"].type is float
    assert [port.type for port in model.out_ports.values()] == [float, int]


def test_a_port_that_is_linked_to_nothing_is_one_of_numbers() -> None:
    model = parse("[top]\nin : idle\nout : mute")
    assert model.in_ports["idle"].type is float
    assert model.out_ports["mute"].type is float


def test_an_atomic_model_without_a_section_has_its_defaults() -> None:
    model = parse("[top]\ncomponents : a@Relay")
    relay = model.components["a"]
    assert isinstance(relay, Relay)
    assert (relay.hold, relay.factor) == (MILLISECOND, 1.0)


def test_a_file_is_read_and_named_in_its_faults(tmp_path: Path) -> None:
    path = tmp_path / "robot.ma"
    path.write_text(TWO_RELAYS.replace("\n", "\r\n"), encoding="utf-8", newline="")
    relay = read_model(path, CLASSES).components["last"]
    assert isinstance(relay, Relay)
    assert relay.hold == SECOND
    path.write_text("[top]\nnonsense\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"robot\.ma: 1 fault\n  - line 2: 'nonsense'"):
        read_model(path, CLASSES)


def test_a_file_that_is_no_text_is_refused_in_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "robot.ma"
    path.write_bytes(TWO_RELAYS.encode("utf-16"))
    with pytest.raises(ConfigError) as refused:
        read_model(path, CLASSES)
    assert str(refused.value) == f"{path}: cannot be read: not UTF-8 in line 1; expected text"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "[top]\ncomponents : a@Relay\n[a]\nfactor : 2\n[top]\nin : x\n[A]\nholdtime : 0:0:0:5",
            "line 5: [top] again: the section goes on; it began further up (and 1 more)",
        ),
        (
            "[top]\ncomponents : a@Relay\n  b@Relay c@Relay\nin : x\ny",
            "line 3: b@Relay c@Relay: the list of components goes on",
        ),
        ("[top]\nspeed : 3\nmass : 4", "line 2: speed: a coupled model has no parameters (and 1"),
        ("[top]\n[b]\nin : x", "line 2: [b]: no model's component"),
        ("[top]\ncomponents : a@Relay\n[a]\nfactor : 2 % aqu\xed", "line 4: a comment: not UTF-8"),
    ],
)
def test_what_is_odd_but_has_a_meaning_is_read_with_a_warning(
    text: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "odd.ma"
    path.write_text(text, encoding="latin-1")
    warnings = Warnings()
    assert read_model(path, CLASSES, warnings).name == "top"
    assert said in warnings.sentences()[0]


def test_a_section_and_a_list_that_go_on_are_wholly_read() -> None:
    model = parse(
        "[top]\ncomponents : a@Relay\nb@Relay\nin : x\n[a]\nfactor : 2\n"
        "[top]\nLink : x in@a\nLink : x in@b\n[a]\nholdtime : 00:00:00:5"
    )
    relay = model.components["a"]
    assert isinstance(relay, Relay)
    assert (relay.hold, relay.factor) == (5 * MILLISECOND, 2.0)
    assert len(model.couplings) == 2


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "no section [top]"),
        ("in : a\n[top]", "line 1: 'in : a': expected a section, such as [top]"),
        ("[top]\nLink a b", "line 2: 'Link a b': expected [name] or key : value"),
        ("[top]\nin : a\nLink : a", "line 3: Link 'a': expected two ports"),
        ("[top]\ncomponents : a@Relay a@Relay", "line 2: component 'a': declared twice"),
        ("[top]\ncomponents : top", "line 2: component 'top': declared twice"),
        ("[top]\ncomponents : a@Motor", "component 'a': unknown class 'Motor'; expected one of R"),
        ("[top]\ncomponents : a", "line 2: component 'a': expected a@Class, or a section [a]"),
        ("[top]\ncomponents : @Relay", "line 2: component '': "),
        ("[top]\ncomponents : a@Relay\n[a]\nin : x", "section [a] describes a coupled model"),
        ("[top]\ncomponents : a@Relay\n[a]\nspeed : 1", "line 4: unknown parameter 'speed'"),
        ("[top]\ncomponents : a@Relay\n[a]\nholdTime : 10", "line 4: holdTime '10': expected HH"),
        ("[top]\ncomponents : a@Relay\n[a]\nfactor : x", "line 4: factor 'x': expected a number"),
        ("[top]\ncomponents : a@Relay\n[a]\nfactor : 0", "line 2: component 'a': factor 0"),
        (
            "[top]\ncomponents : a@Relay\n[a]\nfactor : 1\nFactor : 2",
            "line 5: Factor: given twice",
        ),
        ("[top]\nin : a A", "line 2: port 'A' is declared twice"),
        ("[top]\nout : a a", "line 2: port 'a' is declared twice"),
        (
            "[top]\ncomponents : a@Relay\nLink : b in@a",
            "line 3: Link: 'b' is not an input of top; expected one of none",
        ),
        (
            "[top]\ncomponents : a@Relay\nin : b\nLink : b out@a",
            "line 4: Link: 'out' is not an input of a; expected one of In",
        ),
        (
            "[top]\ncomponents : a@Relay\nout : b\nLink : out@c b",
            "line 4: Link: 'c' is not a component of top; expected one of a",
        ),
        (
            "[top]\ncomponents : a@Relay\nout : b\nLink : in@a b",
            "line 4: Link: 'in' is not an output of a; expected one of Out, whole",
        ),
        (
            "[top]\ncomponents : a@Relay\nout : b\nLink : out@a c",
            "line 4: Link: 'c' is not an output of top; expected one of b",
        ),
        (
            "[top]\ncomponents : a@Relay b@Relay\nLink : out@a count@b",
            "line 3: Link: top.a.Out -> top.b.count: a port of float cannot feed a port of int",
        ),
        (
            "[top]\ncomponents : a@Relay\nin : b\nLink : b in@a\nLink : b in@a",
            "line 5: Link: top.b -> top.a.In: coupled twice",
        ),
    ],
)
def test_what_cannot_be_built_is_a_fault_with_its_line(text: str, fault: str) -> None:
    [found] = faults(text)
    assert fault in found


def test_all_faults_are_listed_at_once_but_not_what_follows_from_them() -> None:
    text = (
        "[top]\ncomponents : a@Motor b@Relay\nin : x\n"
        "Link : x in@a\nLink : out@a in@b\nLink : y in@b"
    )
    assert [fault.split(":")[0] for fault in faults(text)] == ["line 2", "line 6"]


def test_models_without_end_within_each_other_are_a_fault() -> None:
    chain = "".join(f"[m{depth}]\ncomponents : m{depth + 1}\n" for depth in range(3000))
    with pytest.raises(ConfigError, match="within 64 others"):
        parse_model(f"[top]\ncomponents : m0\n{chain}", "chain.ma", CLASSES)


def test_an_output_that_several_feed_takes_the_wider_type() -> None:
    class Wide(Relay):
        def __init__(self, name: str) -> None:
            super().__init__(name)
            self.anything = self.out_port("anything", object)

    classes = CLASSES | {"Wide": AtomicClass(Wide)}
    text = "[top]\ncomponents : a@Relay b@Wide\nout : y\nLink : out@a y\nLink : anything@b y"
    assert parse_model(text, "test.ma", classes).out_ports["y"].type is object


@pytest.mark.parametrize(
    ("links", "types"),
    [
        ("link : x y", (float, float)),
        ("link : x count@r\nlink : x y", (int, int)),
        ("link : x y\nlink : whole@r y", (int, int)),
        ("link : x y\nlink : Out@r y", (float, float)),
    ],
)
def test_an_input_may_be_linked_straight_to_an_output_and_types_go_through(
    links: str, types: tuple[type, type]
) -> None:
    model = parse_model(f"[top]\ncomponents : r@Relay\nin : x\nout : y\n{links}", "a.ma", CLASSES)
    assert (model.in_ports["x"].type, model.out_ports["y"].type) == types


def test_what_is_linked_straight_through_leaves_at_once() -> None:
    text = "[top]\ncomponents : r@Relay\nin : x\nout : y\nlink : x y\nlink : x In@r\nlink : Out@r y"
    lines = run_events(parse_model(text, "a.ma", CLASSES), [Event(SECOND, "x", 3.0)])
    assert [str(line) for line in lines] == ["00:00:01:000 y 3", "00:00:01:001 y 3"]


@pytest.mark.parametrize(
    "line", ['components : g"""x@Relay', "in : a'b", "out : a.b", "components : g\0@Relay"]
)
def test_a_name_that_is_no_word_is_refused(line: str) -> None:
    with pytest.raises(ConfigError, match=r"line 2: .*expected letters, digits, - and _"):
        parse_model(f"[top]\n{line}\n", "x.ma", CLASSES)
