"""The colours: readable on either paper, by the contrast that WCAG 2 asks for."""

import pytest

from firmware_runtime.view.palette import PALETTE

LETTERS = ("ink", "quiet", "good", "doubtful", "bad")
SHAPES = ("blue", "behind", "waking", "garbage", "rest", *(f"colour{n}" for n in range(8)))
SCHEMES = {"light": 0, "dark": 1}


def luminance(colour: str) -> float:
    """Relative luminance of `#rrggbb`. Source: WCAG 2.2, definition of relative luminance."""
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
    ]
    return sum(weight * part for weight, part in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def contrast(one: str, other: str) -> float:
    darker, lighter = sorted((luminance(one), luminance(other)))
    return (lighter + 0.05) / (darker + 0.05)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("paper", ["paper", "panel"])
@pytest.mark.parametrize("letters", LETTERS)
def test_letters_have_a_contrast_of_four_and_a_half(letters: str, paper: str, scheme: str) -> None:
    side = SCHEMES[scheme]
    assert contrast(PALETTE[letters][side], PALETTE[paper][side]) >= 4.5


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("shape", SHAPES)
def test_shapes_that_mean_something_stand_out(shape: str, scheme: str) -> None:
    side = SCHEMES[scheme]
    assert contrast(PALETTE[shape][side], PALETTE["paper"][side]) >= 2
