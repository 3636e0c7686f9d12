"""The certificate that a board's run in each stage replays bit for bit, and its page.

stage_run   one stage as a process of its own, recorded, then replayed
certificate what all stages gave, as JSON
page        the same for people, the stages side by side
"""
