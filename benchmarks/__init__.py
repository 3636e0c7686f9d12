"""Benchmarks against peers, a folder each, and what they share. In no wheel.

`firmware-runtime bench NAME` runs `NAME/bench.py`; each takes turns with its peer and prints its
ratio last.
"""
