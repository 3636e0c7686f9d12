"""A minute of the head, struck by single faults at any moment: none breaks it."""

import pytest

from firmware_runtime.lab.campaign import campaign


@pytest.mark.slow
def test_no_single_fault_breaks_the_head() -> None:
    campaign("pan_tilt", for_s=60.0, runs=8, workers=1).check()
