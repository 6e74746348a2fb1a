"""`stickslip optimise`: a posture or a gait problem, solved, printed, drawn and kept."""
