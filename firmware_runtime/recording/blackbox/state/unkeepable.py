"""What is raised where a state cannot be kept, or cannot be set back."""

from typing import Final

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.errors import ConfigError

EXPECTED: Final = (
    "expected plain values (numbers, texts, tuples, lists, dicts, records) or a class that defines "
    "state() and restore(state)"
)
OTHER_ROBOT: Final = "it is of another robot; expected one of this board and these settings"


class UnkeepableState(ModelError, TypeError):
    """Something within a robot that cannot be kept in a file and set back."""

    def __init__(self, path: str, fault: str) -> None:
        self.path = path
        super().__init__(f"{path}: {fault}; {EXPECTED}")


class ForeignState(ConfigError):
    """A file's state that is none of this robot, or is damaged, or cannot be set back."""

    def __init__(self, fault: str) -> None:
        super().__init__("state", [fault], f"state: {fault}")

    @property
    def is_of_another_robot(self) -> bool:
        """Whether it is the state of other models."""
        return OTHER_ROBOT in self.faults
