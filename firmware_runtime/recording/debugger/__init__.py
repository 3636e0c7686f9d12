"""A debugger of recorded runs: to any instant, forwards and backwards, by event or by instant.

travel (sections, keyframes)  ->  debugger (events), stops (where to)  ->  commands, prompt
"""
