"""What goes out besides pictures: `elements` and `bodies` are what a file is given; `formats` names the writers."""
