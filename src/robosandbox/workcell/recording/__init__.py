"""Episodes on disk: written while they run, read, replayed, drawn and exported."""
