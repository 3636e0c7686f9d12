"""A board's predicted steps beside those of its run, over many seeded boards."""
