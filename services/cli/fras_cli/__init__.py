"""FRAS: cli."""
