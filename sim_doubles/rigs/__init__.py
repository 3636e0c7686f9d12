"""Rigs: a board's chips as doubles on their buses, tied to its world; found by entry point."""
