"""A gripper measured on its model: pads, travel, grasp frame, fingers that collide, grip force."""
