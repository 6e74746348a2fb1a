"""Training runs that can be stopped, killed and gone on with, whatever learns."""
