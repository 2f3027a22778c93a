"""A driver of Franka's arms over libfranka: the entry point `franka` of `robosandbox.drivers`."""
