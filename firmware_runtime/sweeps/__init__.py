"""Sweeps: many runs of one board in virtual time, each with other values, and a table of them."""

from firmware_runtime.sweeps.sweeping import sweep
from firmware_runtime.sweeps.table import Table

__all__ = ["Table", "sweep"]
