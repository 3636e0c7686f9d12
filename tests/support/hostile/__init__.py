"""Datagrams that should not be obeyed, and a judge of each that shares no code with the product."""
