"""Sweeps: many runs of one board in virtual time, each with other values, and a table of them."""

from firmware_runtime.lab.sweeps.sweep_table import Table
from firmware_runtime.lab.sweeps.sweeping import sweep

__all__ = ["Table", "sweep"]
