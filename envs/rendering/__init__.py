"""Pictures, windows and animations. matplotlib, pygame and Pillow are imported at first use."""
