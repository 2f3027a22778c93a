"""Any robot of LeRobot's as a driver."""
