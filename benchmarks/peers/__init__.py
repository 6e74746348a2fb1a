"""The same mechanism in other programs: speed at equal accuracy, creep, and scores there."""
