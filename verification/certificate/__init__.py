"""Proofs from the exact data of a problem: certificates that others can check."""
