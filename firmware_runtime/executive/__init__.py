"""Runs a model against a clock: the loop, overrun accounting, what it asks of the system."""
