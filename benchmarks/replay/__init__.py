"""Whether runs in which much goes wrong are the same when they are run again."""
