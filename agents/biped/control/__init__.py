"""The baseline controllers, a file each, and what they share."""
