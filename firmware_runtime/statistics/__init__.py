"""Numbers that a run leaves: the statistics file, its writer, its reader, and what shows them.

`layout` says what is counted and where, `file` writes it without a system call, `reader` copies it
in any other process at any time. `run_text`, `summary`, `metrics` and the room `view` show a
reading; `comparison`, `history` and traces are made of readings. `paths` names the files beside it.
"""
