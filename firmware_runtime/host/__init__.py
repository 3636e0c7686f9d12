"""Machine that a robot runs on: checks, installation, deployment, new packages.

`doctor` examines it, `installation` makes a service of a board on it, `deployment` brings the
program to another one.
"""
