"""Whole numbers in texts that others wrote: digits of any length and of any script may be there."""

import sys


def whole_number(text: str, most: int = sys.maxsize) -> int | None:
    """Return the number that a text is, in digits of ASCII; None for any other, or above `most`."""
    if not (text.isascii() and text.isdigit()) or len(text.lstrip("0")) > len(str(most)):
        return None
    number = int(text)
    return number if number <= most else None
