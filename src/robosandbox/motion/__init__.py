"""Joint motion: inverse kinematics, collision checks, straight lines, timing."""
