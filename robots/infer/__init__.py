"""A sidecar worked out from the model alone: kinematic tree, gripper, TCP, base, home, each with its evidence."""
