"""A run, run again from its recording: the same drivers and models on what entered then.

recording  ->  feed  ->  lines, clock, world  ->  robot  ->  player  ->  differences
"""
