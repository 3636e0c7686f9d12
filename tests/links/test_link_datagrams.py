"""What may be said to a run: bytes in, a request or a refusal out."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.links.ports.datagrams import (
    LONGEST,
    MOST_PORTS,
    Ask,
    List,
    Put,
    Refusal,
    Time,
    Watch,
    message_of,
    understood,
)
from firmware_runtime.models.motion import Motion

KEYS = ("port", "value", "watch", "every", "list")
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=5,
)


def test_each_kind_is_understood() -> None:
    put = understood(b'{"port": "yaw_reference", "value": {"any": [1]}}')
    assert isinstance(put, Put)
    assert (put.port, bytes(put.value)) == ("yaw_reference", b'{"any": [1]}')
    assert understood(b'{"watch": ["a.b", "c"], "every": 10}') == Watch(("a.b", "c"), 10)
    assert understood(b'{"watch": []}') == Watch((), 1)
    assert understood(b'{"list": true}') == List(list=True)
    assert understood(b'{"request": "arm", "lease_s": 1}') == Ask("arm", {"lease_s": 1})


@pytest.mark.slow
@settings(deadline=None)
@given(st.binary(max_size=200) | st.text(max_size=200).map(lambda text: text.encode()))
def test_any_bytes_are_a_request_or_refused(datagram: bytes) -> None:
    try:
        request = understood(datagram)
    except Refusal:
        return
    assert isinstance(request, Put | Watch | List | Time | Ask)


@pytest.mark.slow
@settings(deadline=None)
@given(st.dictionaries(st.sampled_from(KEYS), json_values, max_size=3))
def test_any_object_is_a_request_with_its_keys_and_types_or_refused(
    said: dict[str, object],
) -> None:
    try:
        request = understood(json.dumps(said).encode())
    except Refusal:
        return
    keys = set(said)
    if isinstance(request, Put):
        assert keys == {"port", "value"}
        assert request.port == said["port"]
    elif isinstance(request, Watch):
        assert keys in ({"watch"}, {"watch", "every"})
        assert list(request.watch) == said["watch"]
        assert request.every >= 1
    else:
        assert keys == {"list"}


@pytest.mark.parametrize(
    "datagram",
    [
        b"",
        b"arm",
        b"[]",
        b"{}",
        b'{"arm": true}',
        b'{"request": 1}',
        b'{"request": "arm", "port": "a"}',
        b'{"port": "a"}',
        b'{"port": "a", "value": 1, "watch": []}',
        b'{"watch": "imu.sample"}',
        b'{"watch": [], "every": 0}',
        b'{"watch": [], "every": 1.5}',
        b'{"watch": [], "every": 1000001}',
        b'{"list": 1}',
        b'{"port": "\xff", "value": 1}',
        json.dumps({"watch": ["a"] * (MOST_PORTS + 1)}).encode(),
        b"[" * LONGEST,
        b'{"port": "a", "value": ' + b"[" * 4000 + b"}",
    ],
)
def test_everything_else_is_refused(datagram: bytes) -> None:
    expected = "expected a JSON object with one of port, watch, list, time, request"
    with pytest.raises(Refusal, match=expected):
        understood(datagram)


def test_a_datagram_may_be_so_long_and_no_longer() -> None:
    longest = b'{"list": true}'.ljust(LONGEST)
    assert understood(longest) == List(list=True)
    with pytest.raises(Refusal, match="too long; expected 16384 bytes at most"):
        understood(longest + b" ")


def test_what_is_sent_looks_as_in_a_trace_file() -> None:
    message = message_of(port="attitude.yaw", t_ns=5, value=Motion(float("nan"), 1.0))
    assert message == b'{"port":"attitude.yaw","t_ns":5,"value":{"position":"nan","rate":1.0}}'
