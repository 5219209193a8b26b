"""FRAS: recorder."""
