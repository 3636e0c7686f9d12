"""Whatever a model file or an event file holds, it is taken, or refused with every fault."""

import os
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.ecdpp.event_file import read_events
from firmware_runtime.ecdpp.model_file import parse_model
from firmware_runtime.errors import ConfigError
from firmware_runtime.system.atomic_file import read_text
from tests.ecdpp.test_model_file import CLASSES

NAMES = st.sampled_from(["top", "a", "b", "c@Relay", "b@a", "In", "Out@c", "x", "count", "1"])
KEYS = st.sampled_from(["components", "in", "out", "Link", "holdTime", "factor", "nothing"])
MODEL_LINES = (
    st.text(max_size=20)
    | NAMES.map(lambda name: f"[{name}]")
    | st.builds(lambda key, words: f"{key} : {' '.join(words)}", KEYS, st.lists(NAMES, max_size=4))
)
NUMBERS = st.integers(-(10**400), 10**400).map(str) | st.floats().map(repr) | st.just("1" * 5000)
TIMES = st.sampled_from(["00:00:00:010", "99999999999999999999:00:00:0", "0:0:0", "-1:0:0:0"])
EVENT_LINES = st.text(max_size=20) | st.builds(
    lambda at, port, value: f"{at} {port} {value}", TIMES | NUMBERS, NAMES, NUMBERS
)


@pytest.mark.slow
@given(st.lists(MODEL_LINES, max_size=12).map("\n".join))
def test_any_model_file_is_taken_or_refused(text: str) -> None:
    with suppress(ConfigError):
        parse_model(text, "hostile.ma", CLASSES)


def test_a_fifo_in_place_of_a_file_is_not_waited_for(tmp_path: Path) -> None:
    fifo = tmp_path / "hostile.ev"
    os.mkfifo(fifo)
    with pytest.raises(ConfigError, match="no regular file"):
        read_text(fifo)


@pytest.mark.slow
@given(st.lists(EVENT_LINES, max_size=6).map("\n".join) | st.binary(max_size=40))
def test_any_event_file_is_taken_or_refused(
    tmp_path_factory: pytest.TempPathFactory, content: str | bytes
) -> None:
    model = Coupled("top")
    for name, kind in (("In", float), ("count", int), ("x", bool)):
        model.in_port(name, kind)
    path: Path = tmp_path_factory.mktemp("events") / "hostile.ev"
    raw = content if isinstance(content, bytes) else content.encode(errors="surrogatepass")
    path.write_bytes(raw)
    with suppress(ConfigError):
        read_events(path, model)
