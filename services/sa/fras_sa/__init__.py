"""FRAS: sa."""
