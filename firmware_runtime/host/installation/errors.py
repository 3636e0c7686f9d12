"""What keeps a board from being installed as a service, or from being removed again."""

from firmware_runtime.errors import FirmwareRuntimeError


class InstallationRefused(FirmwareRuntimeError):
    """Something is not as it must be; nothing was touched."""


class StepFailed(FirmwareRuntimeError):
    """A file could not be written or a program of the system failed; what went before stands."""
