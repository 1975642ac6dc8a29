"""Which body gets the Neumann problem, and which theta."""
