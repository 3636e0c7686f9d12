"""MicroPython's `micropython` for CPython: what has a meaning there only to its compiler."""

from typing import TypeVar

T = TypeVar("T")


def const(value: T) -> T:
    """Return the value."""
    return value


def native(function: T) -> T:
    """Return the function."""
    return function


viper = native
