"""The error of a setting that a chip cannot have; found before anything is written."""

from firmware_runtime.errors import FirmwareRuntimeError


class SettingError(FirmwareRuntimeError, ValueError):
    """A chip cannot be set as asked; the board check lists its sentence among the faults."""
