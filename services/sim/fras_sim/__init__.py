"""FRAS: sim."""
