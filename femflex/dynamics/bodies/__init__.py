"""Contributions of one body: inertia from its moments, strain forces, its shapes and their followers."""
