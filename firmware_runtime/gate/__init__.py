"""Whether timing is as good as it was, or as good as is demanded; "cannot tell here" is an answer.

`gate BASE HEAD` compares two versions of a program by pairs of measurements taken in turns; a limit
on one run is judged by what that run's conditions allow to be said.
"""
