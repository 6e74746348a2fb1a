"""Pictures, animations and pages. matplotlib and Pillow are imported at first use."""
