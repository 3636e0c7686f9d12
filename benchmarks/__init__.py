"""Benchmarks against peers; each runs both side by side and prints its ratio last."""
