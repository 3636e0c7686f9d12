"""Quantized state systems beside scipy's `solve_ivp`."""
