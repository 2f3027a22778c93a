"""The parts of `robo-sandbox repl`: a shell that takes lines, its commands, and the ways in which lines come."""
