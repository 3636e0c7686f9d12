"""Experiments that any board can repeat: each leaves its data, a plot and a page."""
