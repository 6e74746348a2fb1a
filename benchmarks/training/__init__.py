"""Training measured: return against steps and time, on every task of the ladder."""
