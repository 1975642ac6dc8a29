"""What is proved of one step, bound by bound, and how much each of them gives away."""
