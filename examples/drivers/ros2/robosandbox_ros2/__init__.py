"""ROS 2 of wheels: interfaces, a plant to try the driver on, and an outside node."""
