"""Checks of the machine: what spoils a run's timing or keeps it from its chips, and what fixes it.

`registry.GROUPS` lists them. Each is a `Check`: its id, why it matters, what fixes it, and a
function that examines a `Machine` and returns a `Finding`. Checks only read: they change nothing
and actuate nothing.
"""
