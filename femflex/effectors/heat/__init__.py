"""Heat: temperatures of the surfaces of bodies, or given ones, and the strain that they induce."""
