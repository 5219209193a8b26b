"""The page itself: who may enter, what is drawn, what its buttons do."""
