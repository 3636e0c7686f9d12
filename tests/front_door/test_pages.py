"""README.md and pages of docs show programs and what they print."""

import pytest

from tests.support.pages import Example, examples, printed

(HOME,) = examples("index.md")
FIRST, *OTHERS = examples("first-model.md")
(README,) = examples("../README.md")
WITH_ROBOTS = examples("testing.md")
(SWEEP,) = examples("experiments.md")


def lines_of_code(program: str) -> int:
    return sum(1 for line in program.splitlines() if line.strip())


@pytest.mark.slow
@pytest.mark.real_time
def test_the_ten_lines_of_the_home_page_print_what_it_says() -> None:
    assert lines_of_code(HOME.program) <= 10
    assert printed(HOME.program) == HOME.output


@pytest.mark.slow
@pytest.mark.real_time
def test_the_model_of_the_readme_prints_what_it_says() -> None:
    assert printed(README.program) == README.output


@pytest.mark.slow
@pytest.mark.real_time
def test_the_first_model_prints_what_the_page_says_in_real_time() -> None:
    assert printed(FIRST.program) == FIRST.output


@pytest.mark.slow
def test_the_first_model_does_the_same_in_virtual_time() -> None:
    in_virtual_time = FIRST.program.replace("for_s=3.0", 'for_s=3.0, clock="virtual"')
    assert in_virtual_time != FIRST.program
    assert printed(in_virtual_time) == FIRST.output


def test_the_first_model_has_fifteen_lines_at_most() -> None:
    assert lines_of_code(FIRST.program) <= 15


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("example", OTHERS)
def test_every_other_model_prints_what_the_page_says(example: Example) -> None:
    assert printed(example.program) == example.output


@pytest.mark.slow
@pytest.mark.parametrize("example", WITH_ROBOTS)
def test_every_robot_does_what_the_page_says(example: Example) -> None:
    assert printed(example.program) == example.output


def test_every_program_with_a_text_after_it_is_run() -> None:
    assert (len(OTHERS), len(WITH_ROBOTS)) == (2, 4)


@pytest.mark.slow
def test_the_sweep_of_the_page_prints_what_it_says() -> None:
    assert printed(SWEEP.program) == SWEEP.output
