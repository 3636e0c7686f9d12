"""What-if on a recorded run: changed code or settings on what entered, as numbers and plots.

question  ->  elsewhere (a process of its own, for other code)  ->  text, page, watch
"""
