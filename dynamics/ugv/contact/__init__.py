"""Contacts of wheels: placed wheels, the solver of poses and its status."""
