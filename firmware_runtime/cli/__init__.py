"""The command `firmware-runtime`: parse, call, print, and nothing else.

`main` finds the verb, `commands` has a module for each, the others are what several verbs share.
What a verb does is in the rooms below, so that a program can do it too.
"""
