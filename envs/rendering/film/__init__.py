"""Pictures one after another: files and a window."""
