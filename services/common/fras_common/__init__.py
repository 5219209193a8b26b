"""FRAS: common."""
