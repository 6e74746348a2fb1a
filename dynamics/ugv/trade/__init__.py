"""Speed against accuracy: settings, what was measured of them, what is promised."""
