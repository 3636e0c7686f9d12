"""One robot in four stages: simulation, network, remote, embedded."""
