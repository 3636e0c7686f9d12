"""Which keys a class of a model file has, and what installed packages make known."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from firmware_boards.detective.detective import MODEL_FILE

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.ecdpp import atomic_class
from firmware_runtime.ecdpp.atomic_class import GROUP, AtomicClass, known_classes
from firmware_runtime.ecdpp.model_file import parse_model
from firmware_runtime.errors import ConfigError, SettingError
from firmware_runtime.system.packages import EntryPoint


class Server(Atomic):
    """Has an argument of each kind."""

    def __init__(
        self, name: str, mean: float, my_id: int = 0, law: str = "constant", *, extra: object = None
    ) -> None:
        super().__init__(name)
        self.given = (mean, my_id, law, extra)


class Unsettable(Atomic):
    """Has an argument that no file can give."""

    def __init__(self, name: str, table: list[int]) -> None:
        super().__init__(name)
        self.table = table


NO_SERVER = "no atomic"


def parsed(section: str) -> Server:
    classes = {"Server": AtomicClass.of(Server)}
    model = parse_model(f"[top]\ncomponents : a@Server\n[a]\n{section}", "a.ma", classes)
    server = model.components["a"]
    assert isinstance(server, Server)
    return server


def test_a_plain_class_has_the_keys_that_its_annotations_say() -> None:
    server = parsed("Mean : 2\nmy_id : 3\nlaw : poisson")
    assert server.given == (2.0, 3, "poisson", None)
    assert [type(each) for each in server.given[:2]] == [float, int]


@pytest.mark.parametrize(
    ("section", "fault"),
    [
        ("mean : one", "line 4: mean 'one': expected a number"),
        ("mean : 1\nmy_id : 1.5", "line 5: my_id '1.5': expected a whole number"),
        ("mean : 1\nlaw :", "line 5: law '': expected a word"),
        ("mean : 1\nextra : 1", "unknown parameter 'extra'; expected one of mean, my_id, law"),
        ("law : normal", "line 2: component 'a': TypeError: "),
    ],
)
def test_values_that_do_not_fit_are_faults_with_their_lines(section: str, fault: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parsed(section)
    assert any(fault in each for each in caught.value.faults)


def test_an_argument_that_no_file_can_give_is_refused() -> None:
    with pytest.raises(SettingError, match="Unsettable: no file can give 'table'"):
        AtomicClass.of(Unsettable)


def test_a_boards_classes_are_known_to_its_own_files_and_to_others_by_their_whole_names() -> None:
    own = AtomicClass.of(Server)
    assert known_classes({"Motor": own})["Motor"] is own
    classes = {"Sonar1", "Compass2", "MovementController"}
    assert classes <= set(known_classes(file=MODEL_FILE))
    assert not classes & set(known_classes(file=Path("mine.ma")))
    assert {f"firmware-runtime:{each}" for each in classes} <= set(known_classes())


@pytest.fixture
def entry_points(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    """Lets a test say what is installed, `NAME=VALUE` each, by packages a, b and so on."""

    def install(**values: str) -> None:
        points = [
            (package, EntryPoint(name, value, GROUP, ""))
            for package, (name, value) in zip("abc", values.items(), strict=False)
        ]
        found = {GROUP: points}
        monkeypatch.setattr(atomic_class, "of_every_package", lambda group: found.get(group, []))
        atomic_class._installed_classes.cache_clear()

    yield install
    atomic_class._installed_classes.cache_clear()


def test_a_class_may_be_made_known_by_itself(entry_points: Callable[..., None]) -> None:
    entry_points(Server=f"{__name__}:Server")
    assert known_classes()["Server"].build is Server


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        ({"Server": f"{__name__}:NO_SERVER"}, "ma_classes Server of .*'no atomic': expected an"),
        ({"Server": f"{__name__}:Unsettable"}, "no file can give 'table'"),
        ({"Server": "no_such_module:X"}, "ModuleNotFoundError"),
    ],
)
def test_a_package_that_breaks_the_contract_is_named_where_a_class_is_missing(
    entry_points: Callable[..., None], values: dict[str, str], fault: str
) -> None:
    entry_points(Motor=f"{__name__}:Server", **values)
    known = known_classes()
    assert list(known) == ["Motor", "a:Motor"]
    assert (
        parse_model("[top]\ncomponents : a@Motor\n[a]\nmean : 1\n", "top.ma", known).name == "top"
    )
    with pytest.raises(ConfigError, match=fault):
        parse_model("[top]\ncomponents : a@Server\n", "top.ma", known)


def test_a_name_of_two_packages_concerns_only_a_file_that_uses_it(
    entry_points: Callable[..., None],
) -> None:
    server = f"{__name__}:Server"
    entry_points(Server=server, server=server, Queue=server)
    known = known_classes()
    for name in ("Queue", "a:Server", "b:server", "B:SERVER"):
        model = parse_model(f"[top]\ncomponents : s@{name}\n[s]\nmean : 1\n", "top.ma", known)
        assert isinstance(model.components["s"], Server)
    with pytest.raises(ConfigError, match="in several packages; expected a:Server or b:s"):
        parse_model("[top]\ncomponents : s@SERVER\n", "top.ma", known)
    assert known_classes({"Server": AtomicClass.of(Server)})["Server"].build is Server
