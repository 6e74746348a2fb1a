"""Speed against accuracy of a walk: settings, what was measured of them, what is promised."""
