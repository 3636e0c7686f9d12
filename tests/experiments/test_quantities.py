"""Names of numbers in words, and their values with units."""

import pytest

from firmware_runtime.lab.experiments.quantities import in_words, with_unit


@pytest.mark.parametrize(
    ("name", "words", "value", "shown"),
    [
        ("local_delay_p99_ms", "local delay p99", 0.41234, "0.4123 ms"),
        ("stuck_from_s", "stuck from", 8.25, "8.25 s"),
        ("effort_slope_n_per_s", "effort slope", 0.0377, "0.0377 N/s"),
        ("largest_yaw_rate_rad_s", "largest yaw rate", 1.1, "1.1 rad/s"),
        ("yaw_inertia_kg_m2", "yaw inertia", 0.075, "0.075 kg m2"),
        ("lost_percent", "lost", 2.0, "2 %"),
        ("times_stuck", "times stuck", 4.0, "4"),
        ("events", "events", 12_345.0, "12,345"),
        ("s", "s", 1.0, "1"),
    ],
)
def test_a_name_is_words_and_a_unit(name: str, words: str, value: float, shown: str) -> None:
    assert in_words(name) == words
    assert with_unit(name, value) == shown
