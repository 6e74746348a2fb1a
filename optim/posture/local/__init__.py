"""From one drive to a better one near by: convex models, slopes, evolution."""
