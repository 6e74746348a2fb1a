"""Where wheels touch the ground: placed wheels, the solver of poses and what it says."""
