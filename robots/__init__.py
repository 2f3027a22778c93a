"""A robot from its URDF or MJCF and a sidecar."""
