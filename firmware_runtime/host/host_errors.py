"""What keeps a program from being deployed, or a board from being a service."""

from firmware_runtime.errors import FirmwareRuntimeError


class DeploymentError(FirmwareRuntimeError):
    """The target cannot be reached, lacks something, or did not take the program.

    What ran there before is still there; the text says where it is not so.
    """


class InstallationRefused(FirmwareRuntimeError):
    """Something is not as it must be; nothing was touched."""


class StepFailed(FirmwareRuntimeError):
    """A file could not be written or a program of the system failed; what went before stands."""
