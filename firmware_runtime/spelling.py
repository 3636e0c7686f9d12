"""What a word that is not known was probably meant to be."""

from collections.abc import Iterable


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """`; did you mean X?`, or nothing if no known word is like it."""
    from difflib import get_close_matches  # noqa: PLC0415 -- for a word that is not known only

    alike = get_close_matches(word, known, n=1)
    return f"; did you mean {alike[0]}?" if alike else ""
