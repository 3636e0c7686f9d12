"""Doubles in a process of their own: they outlive the runtime that is killed on them."""
