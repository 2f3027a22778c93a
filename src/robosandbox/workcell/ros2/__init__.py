"""A running workcell as a node of a ROS 2 graph."""
