"""Numbers that are proved: what a problem's exact data say of its mesh, with all rounding errors bounded."""
