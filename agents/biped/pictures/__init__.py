"""What plots and pages show of a walk."""
