"""What can keep doubles from being served."""

from firmware_runtime.errors import ConfigError


class ServingError(ConfigError):
    """The socket cannot be had, or the log cannot be written."""

    def __init__(self, sentence: str) -> None:
        super().__init__("doubles", [sentence], sentence)
