"""Packages to begin with: an example for a robot, a template for a chip; words in them replaced."""
