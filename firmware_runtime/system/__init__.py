"""Linux as the runtime sees it: /proc and /sys, processes, files replaced at once, signals.

Beside what is read there are the journal and the service manager's notices. Nothing here knows
models, buses or statistics.
"""
