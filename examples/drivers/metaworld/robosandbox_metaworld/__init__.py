"""MetaWorld as a driver of RoboSandbox."""
