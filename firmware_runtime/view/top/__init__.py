"""Statistics as a live screen; needs the extra `top`."""
