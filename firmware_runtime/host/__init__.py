"""Everything done to the machine a robot runs on: doctor, installation, deployment."""
