"""The task that a policy was made for: in its file, and as the command line changes it."""
