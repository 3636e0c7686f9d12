"""A minute of the head, struck by single faults at any moment: none breaks it."""

import pytest

from firmware_runtime.lab.campaign import campaign


@pytest.mark.slow
def test_no_single_fault_breaks_the_head() -> None:
    campaign("pan_tilt", for_s=60.0, runs=8, workers=1).check()


@pytest.mark.slow
def test_photocells_that_are_exchanged_are_wrong_without_any_fault(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("pan_tilt.wiring.INPUTS", ("AIN0", "AIN2", "AIN1", "AIN3"))
    (found,) = campaign("pan_tilt", runs=1, workers=1).findings
    assert found.oracle == "own"
    assert "beside its light" in found.what
