"""What is proved of one step, bound by bound, and how much each of them gives away."""

#: The semidefinite bound and the losses are worked out up to this many contact nodes: some seconds.
LARGEST = 100
