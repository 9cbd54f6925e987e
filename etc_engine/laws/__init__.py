"""Laws of the contact and of the gap between two particles."""
