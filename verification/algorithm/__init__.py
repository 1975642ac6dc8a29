"""The iteration of Section 3: the map T, rules that choose the next g, runs, and what T does near its fixed point."""
