"""Profiles of the ground: shapes, splines, roughness, hollows, friction by place."""
