"""A minute of the head, struck by single faults at any moment: none breaks it."""

import pytest
from pan_tilt.head import Head

from firmware_runtime.lab.campaign import campaign


@pytest.mark.slow
def test_no_single_fault_breaks_the_head() -> None:
    campaign("pan_tilt", for_s=60.0, runs=8, workers=1).check()


@pytest.mark.slow
def test_a_head_that_never_turns_to_its_light_is_wrong_without_any_fault(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Head, "_turn", lambda head: head.activate("turning"))
    found = campaign("pan_tilt", runs=1, workers=1).findings
    assert [each.oracle for each in found] == ["own"]
    assert "beside its light" in found[0].what
