"""What a drive is worth at its waypoints: stations, evaluated, with their slopes."""
