"""The MuJoCo world and the process that serves it."""
