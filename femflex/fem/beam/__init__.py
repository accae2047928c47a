"""Beam members: straight elements in space."""
