"""Proofs about matrices of bodies: bounds of their exact entries, Schur complements and eigenvalues."""
