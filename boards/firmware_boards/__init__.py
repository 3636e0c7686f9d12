"""Robots: each folder is one board, `board.toml` (its numbers) and `wiring.py` (its schematic)."""
