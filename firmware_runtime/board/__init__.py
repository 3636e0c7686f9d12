"""Boards: their settings, checks and bus budget, and the robot they make.

A board comes from any package by an entry point. `registry` finds and reads it, `strict` and
`variants` refuse what its file may not say, `faults` is what its definition works with, and `robot`
is what its wiring returns. Nothing here runs anything; that is `runs`.
"""
