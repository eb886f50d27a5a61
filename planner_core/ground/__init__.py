"""Ground: where a surveyor can walk and set up, and how far it is on foot."""
