"""Builders and references that several test modules share."""
