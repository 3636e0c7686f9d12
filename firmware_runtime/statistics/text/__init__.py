"""Statistics as text for a terminal."""
