"""Numbers that a run leaves: the statistics file, its writer, its reader, and what shows them.

`layout` says what is counted and where, `file` writes it without a system call, `reader` copies it
in any other process at any time. `text`, `page`, `top` and `prometheus` show a reading; comparison,
timeline and traces are made of readings. `companions` names the files beside it.
"""
