"""Benches: a board's chips as doubles on their buses, tied to its world. Known to the CLI alone."""
