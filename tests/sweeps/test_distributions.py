"""Distributions in words: their values, and a sentence for each that says nothing."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.lab.sweeps.distributions import FORMS, Drawn, Grid, Value, distribution

shares = st.floats(0.0, 1.0, exclude_min=True, exclude_max=True)


def drawn(words: str, share: float) -> Value:
    found = distribution(words)
    assert isinstance(found, Drawn)
    return found.quantile(share)


def levels(words: str) -> list[Value]:
    found = distribution(words)
    assert isinstance(found, Grid)
    return [found.level(index) for index in range(found.size)]


@given(shares)
def test_a_uniform_value_lies_between_its_ends(share: float) -> None:
    value = drawn("uniform(2, 4)", share)
    assert isinstance(value, float)
    assert 2 <= value <= 4
    assert value == pytest.approx(2 + 2 * share)


@given(shares)
def test_the_logarithm_of_a_loguniform_value_is_uniform(share: float) -> None:
    value = drawn("loguniform(0.01, 100)", share)
    assert isinstance(value, float)
    assert math.log10(value) == pytest.approx(-2 + 4 * share)


def test_half_of_a_normal_distribution_is_below_its_mean() -> None:
    assert drawn("normal(3, 0.5)", 0.5) == 3.0
    assert drawn("normal(3, 0.5)", 0.8413447460685429) == pytest.approx(3.5)


def test_each_choice_has_an_equal_share() -> None:
    words = "choice(1, 2.5, true, platform)"
    assert [drawn(words, share) for share in (0.1, 0.3, 0.6, 0.9)] == [1, 2.5, True, "platform"]


def test_grids_have_their_values_in_order() -> None:
    assert levels("linspace(0, 1, 5)") == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert levels("range(3)") == [0, 1, 2]
    assert levels("range(-1, 2)") == [-1, 0, 1]
    assert all(type(each) is int for each in levels("range(3)"))


@pytest.mark.parametrize(
    "words",
    [
        "",
        "uniform",
        "uniform()",
        "uniform(1)",
        "uniform(2, 2)",
        "uniform(3, 2)",
        "uniform(a, b)",
        "uniform(1, inf)",
        "gauss(1, 2)",
        "normal(0, 0)",
        "normal(0, -1)",
        "loguniform(0, 1)",
        "choice()",
        "choice(1; 2)",
        "choice([1])",
        "linspace(0, 1, 1)",
        "linspace(0, 1, 2.5)",
        "range(0)",
        "range(1.5)",
        "range(2, 2)",
        "range(1, 2, 3)",
        "range(100000000)",
        "import os",
    ],
)
def test_what_is_no_distribution_is_refused_with_how_it_is_written(words: str) -> None:
    with pytest.raises(ValueError, match="expected") as refused:
        distribution(words)
    assert words in str(refused.value)
    assert any(form in str(refused.value) for form in FORMS.values())


def test_a_grid_of_too_many_is_refused_by_how_many_there_may_be() -> None:
    with pytest.raises(ValueError, match="no whole number from 2 to 10000000"):
        distribution("linspace(0, 1, 10000001)")
