"""robosuite as a driver of RoboSandbox."""
