"""Values among the words of the command line: JSON, or else a text or the name of a member."""

import msgspec


def is_json(word: str) -> bool:
    """Whether a word is a value in JSON; one that is none stands for itself."""
    try:
        msgspec.json.decode(word)
    except (msgspec.MsgspecError, UnicodeEncodeError, RecursionError):
        return False
    return True
