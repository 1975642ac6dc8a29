"""Couplings of two solvers: what is known of one, the advice that follows, and the loop itself."""
