"""What verbs are made of: hands, grasps, ways, places, drawers, what the arm feels."""
