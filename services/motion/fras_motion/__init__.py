"""FRAS: motion."""
