"""What a sweep says: words, pictures, comparisons, episodes to show."""
