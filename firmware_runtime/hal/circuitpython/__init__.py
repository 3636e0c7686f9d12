"""CircuitPython's names on any Linux machine, so that its drivers are imported without Blinka.

`i2c_base` is what a bus of theirs must do; `stand_ins` finds the other modules.
"""
