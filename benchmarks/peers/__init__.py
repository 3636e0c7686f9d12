"""The same periodic model in real time on several engines."""
