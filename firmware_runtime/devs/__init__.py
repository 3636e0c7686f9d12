"""The formalism: Parallel DEVS, and classic DEVS with Select. No clock, no I/O, no threads.

Here are the models (`atomic`, `coupled`, `ports`), the two simulators (`simulator`, `classic`) on
what they share (`engine`, `agenda`, `wiring`), and what watches them: `checked`, `trace`. A
simulator works off one instant after the other; the executive waits in between.
"""
