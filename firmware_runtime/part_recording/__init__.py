"""What entered a part of a robot's model and what left it: recorded, run again, compared.

    run --record        recorder -> writer (a process of its own) -> file
    replay, continuity  file -> player -> comparison -> certificate

The part is the one that the cut of the board's roles leaves, see `board.roles`.
"""
