"""What changed code or settings would have said in a recorded run: numbers, plots, every save.

question  ->  elsewhere (a process of its own, for other code)  ->  text, page, watch
"""
