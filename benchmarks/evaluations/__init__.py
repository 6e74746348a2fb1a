"""What an evaluation of a posture problem costs, beside an earlier state of the package."""
