"""A driver of an arm in a ROS 2 graph: the entry point `ros2` of `robosandbox.drivers`."""
