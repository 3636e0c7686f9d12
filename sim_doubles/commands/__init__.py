"""Verbs that doubles add to the command line."""
