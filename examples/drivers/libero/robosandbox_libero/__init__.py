"""LIBERO's environment as a driver of RoboSandbox, and a bench under its own judge."""
