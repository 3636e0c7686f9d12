"""Who drives outputs of one chip: what stops them all at once must have the chip to itself."""

from firmware_runtime.errors import SettingError


class OutputUsers:
    """The models and bridges that drive outputs of the chip at `place`, by name."""

    def __init__(self, place: str) -> None:
        self._place = place
        self._names: list[str] = []
        self._stops_all: str | None = None

    def add(self, name: str, *, stops_all: bool = False) -> None:
        """Let one more drive outputs; `stops_all`: it turns all of the chip's off when it stops.

        Raises SettingError where one of two would be switched off by the other, unnoticed.
        """
        alone = name if stops_all else self._stops_all
        if alone is not None and self._names:
            other = self._names[0] if stops_all else name
            raise SettingError(
                f"{alone} turns all outputs off when it stops, and {other} drives some of them",
                where=self._place,
                expected=f"a chip of its own for {alone}",
            )
        self._names.append(name)
        self._stops_all = alone
