"""Experiments: campaigns over the real stack, repeated, counted and drawn."""
