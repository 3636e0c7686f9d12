"""What is done to the machine that a robot runs on, before and after it runs.

`doctor` examines it, `installation` makes a service of a board on it, `deployment` brings the
program to another one.
"""
