"""What can keep doubles from being served."""

from firmware_runtime.errors import FirmwareRuntimeError


class ServingError(FirmwareRuntimeError):
    """The socket cannot be had, or the log cannot be written."""
