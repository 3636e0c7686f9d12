"""Packages to begin with: templates are real files, and writing one is plain substitution."""
