"""The same mechanism in other programs, and how fast each is at equal accuracy."""
