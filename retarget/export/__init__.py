"""What goes out besides pictures: `tables` writes the curves as CSV."""
