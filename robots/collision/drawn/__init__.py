"""Collision bodies from the shapes that a URDF draws."""
