"""The trained policies of the package: trained, chosen, measured and put there by one command."""
