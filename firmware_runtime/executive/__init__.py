"""Runs a model against a clock: the one loop, overrun accounting, and what it asks of the system."""
