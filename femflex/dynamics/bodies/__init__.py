"""What one body adds: inertia from its moments, strain forces, its shapes, and those that follow others."""
