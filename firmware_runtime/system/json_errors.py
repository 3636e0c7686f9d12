"""What is raised for bytes that are no JSON of a type."""

from typing import Final

import msgspec

NOT_JSON: Final = (msgspec.MsgspecError, UnicodeDecodeError, RecursionError)
"""By msgspec's decoders: beside errors of its own those of a text that is no UTF-8, and of what is
nested too deep."""
