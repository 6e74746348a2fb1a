"""Speed against accuracy of poses: settings, what was measured of them, what is promised."""
