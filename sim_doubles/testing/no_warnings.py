"""The assertion that no chip was asked for what a real one would not take as meant."""

import pytest

from sim_doubles.testing.buses import TestBuses


def check(buses: TestBuses) -> None:
    """Fail the test where a double of these buses warned, with every warning."""
    __tracebackhide__ = True
    if warnings := buses.warnings():
        listing = "\n".join(f"  {each}" for each in warnings)
        pytest.fail(f"protocol warnings, expected none:\n{listing}", pytrace=False)
