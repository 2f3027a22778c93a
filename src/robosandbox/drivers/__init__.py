"""Drivers that ship with the package beside the simulation; each is an entry point."""
