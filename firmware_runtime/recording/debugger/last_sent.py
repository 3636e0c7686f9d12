"""Last values of ports before any place of a recording, as they are recorded."""

from collections.abc import Sequence
from typing import Any, Final

from firmware_runtime.recording.blackbox.reader import kind_of
from firmware_runtime.recording.blackbox.section import Kind, sent_in

_KEPT_EVERY: Final = 500
"""Sections between two places whose values are kept, so that the next need not begin at 0."""


class LastSent:
    """Of these sections; what was looked for is found again without reading all of them."""

    def __init__(self, contents: Sequence[bytes]) -> None:
        self._contents = contents
        self._forms: dict[int, dict[int, Any]] = {0: {}}

    def before(self, place: int) -> dict[int, Any]:
        """The form of each port's last value, by its number, when so many sections were taken."""
        begin = max(each for each in self._forms if each <= place)
        forms = dict(self._forms[begin])
        for index in range(begin, place):
            content = self._contents[index]
            if kind_of(content) != Kind.HEADER:
                forms.update(sent_in(content))
            if (index + 1) % _KEPT_EVERY == 0:
                self._forms[index + 1] = dict(forms)
        return forms
