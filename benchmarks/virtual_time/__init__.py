"""How fast a whole robot runs in virtual time."""
