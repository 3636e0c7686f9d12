"""The live page's process: follows a run by its recording and statistics, and serves what it sees.

The run neither waits for it nor knows of it. What is drawn is in `firmware_runtime.view`; this room
is its data behind a web server, which no other process imports. Everything that the page asks for
is here, a module each (not below `view`, which knows neither recordings nor runs).
"""
