"""What a sweep keeps on the disk, and how it is read."""
