"""From scene coordinates to the site's: by what the scene file says of them, what a user does, or control points."""
