"""What benches share: engines in turns, a robot in a process of its own, conditions, results."""
