"""A debugger of recorded runs: to any instant, forwards and backwards, by event or by instant.

travel (sections, keyframes)  ->  debugger (events, where to stop)  ->  commands, prompt
"""
