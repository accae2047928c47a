"""Measures: numbers taken from runs, bodies and crafts, which cases expect and studies follow, and verdicts on them."""
