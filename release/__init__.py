"""What makes FRAS a release: distributions that are tried, what they need, and its licences."""
