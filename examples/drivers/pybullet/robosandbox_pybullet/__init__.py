"""A driver of RoboSandbox over the Bullet engine: the Panda of `pybullet_data` at a table, with RGB-D cameras."""
