"""Whether a device node may be opened."""

import os
from pathlib import Path

import pytest

from firmware_runtime.hal.linux import check_node
from firmware_runtime.hal.wire_errors import BusAbsent


def test_a_port_that_may_be_opened_is_left_as_it_was() -> None:
    ours, theirs = os.openpty()
    os.write(ours, b"waiting\n")
    check_node("treads", os.ttyname(theirs))
    assert os.read(theirs, 100) == b"waiting\n"
    for each in (ours, theirs):
        os.close(each)


def test_a_node_that_is_not_there_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(BusAbsent, match=r"^i2c1: .*/i2c-1 cannot be opened \(No such file"):
        check_node("i2c1", str(tmp_path / "i2c-1"))
