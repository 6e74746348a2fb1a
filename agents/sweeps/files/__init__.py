"""What a sweep keeps on the disk: its directory, chunks and their columns."""
