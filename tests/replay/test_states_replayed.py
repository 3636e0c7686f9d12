"""A state that differs is named by model and field; one that cannot be kept costs no replay."""

from pathlib import Path

import pytest

from firmware_runtime.recording.replay.difference import Difference, model_and_field
from tests.support.allocation import has_attribute
from tests.support.recorded import record
from tests.support.replayed import check_identical, replayed

MODELS = {"", "controller", "controller.yaw", "imu"}


@pytest.mark.parametrize(
    ("path", "found"),
    [
        ("controller.yaw.gains.kp", ("controller.yaw", "gains.kp")),
        ("controller.yaw.table['a.b'][3].x", ("controller.yaw", "table['a.b'][3].x")),
        ("imu[0]", ("imu", "[0]")),
        ("accounting.accounts[3].cause", ("accounting", "accounts[3].cause")),
        ("began_at", ("", "began_at")),
    ],
)
def test_a_state_is_that_of_a_model(path: str, found: tuple[str, str]) -> None:
    assert model_and_field(path, MODELS) == found


class Silent:
    """Says nothing of itself."""

    def __repr__(self) -> str:
        raise RuntimeError("no word")


def test_a_value_that_says_nothing_of_itself_is_named_by_its_class() -> None:
    said = Difference(0, "state", "model", "field", Silent(), None).as_json()
    assert (said["recorded"], said["replayed"]) == ("a Silent", None)


@pytest.mark.slow
def test_a_state_that_cannot_be_looked_at_costs_no_replay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    has_attribute(monkeypatch, "silent", lambda _: {Silent(), Silent()})
    check_identical(record(tmp_path / "run", "tachobot", 1.0))


def test_an_attribute_of_a_model_is_compared_whatever_it_is_called(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    has_attribute(monkeypatch, "cause", lambda _: {"a.b": 1})
    path = record(tmp_path / "run", "tachobot", 1.0)
    check_identical(path)
    has_attribute(monkeypatch, "cause", lambda _: {"a.b": 2})
    first = replayed(path).first
    assert first is not None
    assert (first.what, first.where) == ("state", "controller.allocation.cause")
