"""Model files of robots, URDF or MJCF, to one MuJoCo spec with servos, inertias and collision pairs that work."""
