"""What the page of format `field` is made of: its style and its script."""
