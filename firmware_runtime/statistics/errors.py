"""What can be wrong with a statistics file."""

from firmware_runtime.errors import FirmwareRuntimeError


class StatisticsFileError(FirmwareRuntimeError):
    """A statistics file is absent, not ours, of another version, damaged, or cannot be made."""
