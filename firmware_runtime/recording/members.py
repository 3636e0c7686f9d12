"""Members of enumerations as they are written: by name, several of a Flag together by number."""

from enum import Enum
from typing import Any


def written_member(member: Enum) -> Any:  # noqa: ANN401 -- a Flag's number is an int
    """What it is called; several members of a Flag together have no name."""
    return member.name if member.name in type(member).__members__ else member.value


def member_of(kind: type[Enum], written: Any) -> Enum:  # noqa: ANN401 -- whatever is in a file
    """The member that was written so. Raises KeyError or ValueError."""
    return kind[written] if isinstance(written, str) else kind(written)
