"""What can be wrong with a file that a run keeps."""

from firmware_runtime.errors import FirmwareRuntimeError


class StatisticsFileError(FirmwareRuntimeError):
    """A statistics file is absent, not ours, of another version, damaged, or cannot be made."""


class TraceFileError(FirmwareRuntimeError):
    """A trace cannot be written where it was asked for."""
