"""What keeps one process from speaking with another."""

from firmware_runtime.errors import FirmwareRuntimeError


class ControlError(FirmwareRuntimeError):
    """A run cannot be spoken to."""
