"""FRAS: planner."""
