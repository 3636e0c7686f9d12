"""What can go wrong on the way to a target."""

from firmware_runtime.errors import FirmwareRuntimeError


class DeploymentError(FirmwareRuntimeError):
    """The target cannot be reached, lacks something, or did not take the program.

    What ran there before is still there; the text says where it is not so.
    """
