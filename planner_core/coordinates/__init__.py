"""From scene coordinates to the site's: by the scene file, the user's options, or control points."""
