"""Motion capture made cartoon-like.  Nothing is here yet: rubber, analogies and posing follow."""
