"""What a word that is not known was probably meant to be, and the article before one."""

from collections.abc import Iterable


def with_article(noun: str) -> str:
    """`a NOUN` or `an NOUN`, by its first letter."""
    return f"{'an' if noun[:1].lower() in tuple('aeiou') else 'a'} {noun}"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """`; did you mean X?`, or nothing if no known word is like it."""
    from difflib import get_close_matches  # noqa: PLC0415 -- for a word that is not known only

    alike = get_close_matches(word, known, n=1)
    return f"; did you mean {alike[0]}?" if alike else ""
