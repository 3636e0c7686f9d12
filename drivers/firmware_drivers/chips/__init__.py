"""Chip drivers, one chip a file: registers on one side, SI units on the other; no DEVS, no wait.

`step`, `setting`, `mounting`, `bearing` and `mpu9250_*` are parts that drivers share or are made
of; `h_bridge` is three outputs of a PCA9685.
"""
