"""What is drawn over the world: what was planned, measured and found out, a module each."""
