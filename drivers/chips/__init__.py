"""Chip drivers, one chip a file: registers on one side, SI units on the other; no DEVS, no wait.

`step`, `setting`, `mounting` and `mpu9250_burst` are parts that drivers share or are made of.
"""
