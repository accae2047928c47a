"""Static equilibrium of structures under steady loads, about which they then vibrate."""
