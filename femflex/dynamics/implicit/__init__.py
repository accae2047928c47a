"""The equations of motion (9) for implicit integrators and studies, each call compiled when first used.

RESIDUAL   residual(t, q, u, udot, out, table, pool, work): out = M udot + h - Q
SOLVE      solve(t, q, rhs, out, c_m, c_d, c_k, table, pool, work): out = (c_m M + c_d D + c_k K)^-1 rhs
CORRECT    see femflex.integrate.protocol

The states z stand behind the quasi-velocities: u is (n_u + n_z,) = (u, z), and so is the right side rhs of SOLVE,
whose own numbers are the first n_u. Outputs are (n_u,), those of CORRECT (n_u + n_z,).
"""
