"""Runs a model against a clock: one loop for real, scaled and virtual time.

`loop` is the whole of it, and `executive` what comes before it and after it; `clocks` and `inbox`
are what it waits for, `process` what it asks of the operating system, `account` and its neighbours
count what became of every event, and `ledger` writes that into the statistics file. It knows no
board, no chip and no command.
"""
