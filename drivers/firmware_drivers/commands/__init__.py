"""Verbs that drivers add to the command line."""
