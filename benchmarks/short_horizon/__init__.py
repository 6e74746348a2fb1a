"""Policy gradients through the simulator: what they learn, and where they mislead."""
