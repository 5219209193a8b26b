"""FRAS: the surgeon's page."""
