"""The suite of instances: what is known of them, found and verified."""
