"""Two bodies condensed onto the surfaces on which they meet, and what joins them."""
