"""What one replay of one recording on one machine gave."""

from msgspec import Struct


class Place(Struct, frozen=True, kw_only=True):
    """Where a recording and its replay part: one number, text or truth value, and both sides."""

    what: str
    """`input`, `state` or `output`; of a whole run `value` (of a port), `write`, `state`, `count`,
    `step`, `end` or `asked`.
    """
    t_ns: int
    model: str
    """Path below the root."""
    port: str | None = None
    """Of an input or output event."""
    field: str
    """Of the model's state, or of the port's value; empty for the value itself."""
    recorded: str
    replayed: str
    units_apart: int | None = None
    """Floats between the two, one more than that: 1 is the next float."""

    @property
    def name(self) -> str:
        """Model, port and field, joined by dots."""
        return ".".join(filter(None, (self.model, self.port, self.field)))


class Finding(Struct, frozen=True, kw_only=True):
    """What a recording and its replay on one machine have in common."""

    recording: str
    """The file's name."""
    sha256: str
    """Of the file."""
    board: str
    made_with: dict[str, str | None]
    """Versions of Python, kernel and packages in the recorded run."""
    duration_s: float
    events: int
    """Output events recorded; of a whole run all values that left ports."""
    inputs: int = 0
    fields: int = 0
    """Values of fields of the models' state that both sides had and that were compared."""
    steps: int = 0
    """Of a whole run: steps of the loop, and transfers on its buses and ports."""
    transfers: int = 0
    differences: int
    """Output events that are not the same; of a whole run whatever is not."""
    first: Place | None = None
    """The first difference, of an input, a field of the state or an output event."""
    first_output: Place | None = None
    fault: str | None = None
    """What keeps the comparison from meaning anything."""
    code_sha256: str | None = None
    """Of the code that replayed."""
    code_changed: list[str] = []
    """Modules whose source is another than in the recorded run."""
    has_drawn: bool = False
    """Whether the replay drew from the process's own generators of random numbers."""

    @property
    def is_identical(self) -> bool:
        """Whether nothing at all differs, and nothing is missing."""
        return self.differences == 0 and self.first is None and self.fault is None
