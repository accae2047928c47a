"""Linear buckling of bodies under the loads of a run."""
