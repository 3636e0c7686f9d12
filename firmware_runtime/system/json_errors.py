"""What is raised for bytes, or a text, that are no JSON of a type."""

from typing import Final

import msgspec

NOT_JSON: Final = (msgspec.MsgspecError, UnicodeError, RecursionError)
"""By msgspec's decoders, of MessagePack too: beside errors of their own those of a text that UTF-8
has not, and of what is nested too deep."""
