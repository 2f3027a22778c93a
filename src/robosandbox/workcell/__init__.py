"""A running cell: its options, its session, its recording and its face to the network."""
