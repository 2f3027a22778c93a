"""A driver of arms of serial bus servos, as SO-100 and SO-101: the entry point `feetech` of `robosandbox.drivers`."""
