"""One symbolic picture of what is where: relations computed by geometry from what is seen."""
